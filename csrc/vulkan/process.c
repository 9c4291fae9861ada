#include "vulkan/process.h"

#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <string.h>
#include <sys/utsname.h>

// One more in each child of a fork. Process ids do not tell a child from its parent in another
// namespace of ids, as containers have: both may be 1.
static atomic_long current = 1;

static void count(void)
{
    atomic_fetch_add(&current, 1);
}

static void count_in_children(void)
{
    // It fails only without memory, at the start of a process.
    (void)pthread_atfork(NULL, NULL, count);
}

long vkb_current_process(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;

    pthread_once(&once, count_in_children);
    return atomic_load(&current);
}

bool vkb_fork_leaves_pinned(void)
{
    struct utsname name;
    int major = 0, minor = 0;

    return uname(&name) == 0
        && (strcmp(name.sysname, "Linux") != 0
            || (sscanf(name.release, "%d.%d", &major, &minor) == 2
                && (major > 5 || (major == 5 && minor >= 12))));
}

void vkb_lock_acquire(struct vkb_lock *lock)
{
    enum { SHORT_TURNS = 100 };
    const long process = vkb_current_process();
    long holder = 0;
    int turns = 0;

    while (!atomic_compare_exchange_weak(&lock->holder, &holder, process))
        if (holder == process) {
            // Whoever holds it for long is at work: its waiters sleep for a millisecond.
            ++turns;
            if (turns < SHORT_TURNS)
                sched_yield();
            else
                poll(NULL, 0, 1);
            holder = 0;
        }
}

void vkb_lock_release(struct vkb_lock *lock)
{
    atomic_store(&lock->holder, 0);
}
