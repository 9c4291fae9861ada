#include "vulkan/process.h"

#include <pthread.h>
#include <sched.h>
#include <stdbool.h>
#include <unistd.h>

static atomic_long current;  // 0: not known
static bool forgets;         // whether a fork's child forgets it

static void forget(void)
{
    atomic_store(&current, 0);
}

static void forget_in_children(void)
{
    forgets = pthread_atfork(NULL, NULL, forget) == 0;
}

// Kept, since getpid() is a system call, and each call of a renderer asks several times.
long vkb_current_process(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    long process = atomic_load(&current);

    if (process != 0)
        return process;
    pthread_once(&once, forget_in_children);
    process = (long)getpid();
    if (forgets)
        atomic_store(&current, process);
    return process;
}

void vkb_lock_acquire(struct vkb_lock *lock)
{
    const long process = vkb_current_process();
    long holder = 0;

    while (!atomic_compare_exchange_weak(&lock->holder, &holder, process))
        if (holder == process) {
            sched_yield();
            holder = 0;
        }
}

void vkb_lock_release(struct vkb_lock *lock)
{
    atomic_store(&lock->holder, 0);
}
