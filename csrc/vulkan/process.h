// What tells processes apart, and locks that are free in a forked process.
#ifndef VKB_PROCESS_H
#define VKB_PROCESS_H

#include <stdatomic.h>
#include <stdbool.h>

// A number that none of the processes has from which this one was forked; never 0.
long vkb_current_process(void);

// Whether a fork leaves pages that a GPU has pinned to the parent. Before Linux 5.12 the parent
// gets a copy at its next write, and the GPU goes on with the page of the child.
bool vkb_fork_leaves_pinned(void);

// A lock whose waiters look again and again, and sleep between if it takes long. Zeroed: free.
struct vkb_lock {
    atomic_long holder;  // the process whose thread holds it; 0: none
};

// A lock that a thread of the parent held during a fork is free in the child, where this thread
// does not exist.
void vkb_lock_acquire(struct vkb_lock *lock);
void vkb_lock_release(struct vkb_lock *lock);

#endif
