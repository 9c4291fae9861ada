#include "vulkan/process.h"

#ifdef _WIN32

long vkb_current_process(void)
{
    return 1;  // this platform has no fork
}

static void yield(void)
{
}

#else

#include <sched.h>
#include <unistd.h>

long vkb_current_process(void)
{
    return (long)getpid();
}

static void yield(void)
{
    sched_yield();
}

#endif

void vkb_lock_acquire(struct vkb_lock *lock)
{
    const long process = vkb_current_process();
    long holder = 0;

    while (!atomic_compare_exchange_weak(&lock->holder, &holder, process))
        if (holder == process) {
            yield();
            holder = 0;
        }
}

void vkb_lock_release(struct vkb_lock *lock)
{
    atomic_store(&lock->holder, 0);
}
