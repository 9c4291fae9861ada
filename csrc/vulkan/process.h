// Which process this is, and locks that a fork does not leave held.
#ifndef VKB_PROCESS_H
#define VKB_PROCESS_H

#include <stdatomic.h>

// This process's number, whatever it was forked from; never 0.
long vkb_current_process(void);

// Held for short times: who waits for it does not sleep. Zeroed: free.
struct vkb_lock {
    atomic_long holder;  // the process whose thread holds it; 0: none
};

// A lock that a thread of the parent held at the fork is free in the child, which has no such
// thread.
void vkb_lock_acquire(struct vkb_lock *lock);
void vkb_lock_release(struct vkb_lock *lock);

#endif
