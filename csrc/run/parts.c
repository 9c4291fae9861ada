// For the count of usable cores.
#define _GNU_SOURCE

#include "run/parts.h"

#ifdef _WIN32

void vkb_in_parts(vkb_rows *rows, void *context, uint32_t first, uint32_t end, size_t size)
{
    (void)size;
    rows(context, 0, first, end);
}

#else

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdbool.h>
#include <unistd.h>

// A thread takes about 20 us to start and end, in which a core copies some hundred kilobytes.
enum { LEAST_SIZE = 2 << 20 };

struct part {
    vkb_rows *rows;
    void *context;
    uint32_t index, first, end;
    pthread_t thread;
    bool started;
};

static uint32_t core_count(void)
{
#ifdef CPU_COUNT
    cpu_set_t usable;

    if (sched_getaffinity(0, sizeof usable, &usable) == 0)
        return (uint32_t)CPU_COUNT(&usable);
#endif
    const long count = sysconf(_SC_NPROCESSORS_ONLN);
    return count > 0 ? (uint32_t)count : 1;
}

static void *do_part(void *argument)
{
    struct part *part = argument;

    part->rows(part->context, part->index, part->first, part->end);
    return NULL;
}

static void start(struct part *part)
{
    part->started = pthread_create(&part->thread, NULL, do_part, part) == 0;
}

static uint32_t part_count(uint32_t rows, size_t size)
{
    const uint32_t cores = core_count();
    size_t count = size / LEAST_SIZE;

    count = count < cores ? count : cores;
    count = count < VKB_MAX_PARTS ? count : VKB_MAX_PARTS;
    count = count < rows ? count : rows;
    return count ? (uint32_t)count : 1;
}

void vkb_in_parts(vkb_rows *rows, void *context, uint32_t first, uint32_t end, size_t size)
{
    struct part parts[VKB_MAX_PARTS];
    const uint32_t count = part_count(end - first, size);
    sigset_t all, before;

    for (uint32_t i = 0; i < count; ++i)
        parts[i] = (struct part){
            .rows = rows,
            .context = context,
            .index = i,
            .first = first + (uint32_t)((uint64_t)(end - first) * i / count),
            .end = first + (uint32_t)((uint64_t)(end - first) * (i + 1) / count),
        };

    // Threads inherit the mask. A signal handler of the application must not run in one of them.
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    for (uint32_t i = 1; i < count; ++i)
        start(&parts[i]);
    pthread_sigmask(SIG_SETMASK, &before, NULL);

    do_part(&parts[0]);
    for (uint32_t i = 1; i < count; ++i) {
        if (parts[i].started)
            pthread_join(parts[i].thread, NULL);
        else
            do_part(&parts[i]);
    }
}

#endif
