// For the count of usable cores.
#define _GNU_SOURCE

#include "run/parts.h"

#ifdef _WIN32

void vkb_in_parts(vkb_rows *rows, vkb_rows_done *done, void *context, uint32_t first, uint32_t end,
                  size_t size)
{
    (void)size;
    rows(context, 0, first, end);
    if (done)
        done(context, end);
}

#else

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <unistd.h>

enum {
    // A thread takes about 20 us to start and end, in which a core copies some hundred kilobytes.
    LEAST_SIZE = 2 << 20,
    // Of the rows that a thread takes at once.
    CHUNK_SIZE = 256 << 10,
    MAX_CHUNKS = 256,
};

struct work;

struct part {
    struct work *work;
    pthread_t thread;
    bool started;
};

struct work {
    vkb_rows *rows;
    void *context;
    uint32_t first, end, chunk_rows, chunk_count;
    atomic_uint taken;  // chunks so far
    atomic_bool done[MAX_CHUNKS];
    uint32_t part_count;
    struct part parts[VKB_MAX_PARTS];
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

static uint32_t chunk_end(const struct work *work, uint32_t chunk)
{
    const uint32_t left = work->end - work->first;
    const uint64_t rows = (uint64_t)(chunk + 1) * work->chunk_rows;

    return work->first + (rows < left ? (uint32_t)rows : left);
}

// Does one chunk; false: there is none left.
static bool do_chunk(struct work *work, uint32_t part)
{
    const uint32_t chunk = atomic_fetch_add(&work->taken, 1);

    if (chunk >= work->chunk_count)
        return false;
    work->rows(work->context, part, work->first + chunk * work->chunk_rows, chunk_end(work, chunk));
    atomic_store(&work->done[chunk], true);
    return true;
}

static void *do_part(void *argument);

// Each part starts two others, since to start all one by one takes as long as a part of the work.
static void start_next(struct work *work, uint32_t part)
{
    for (uint32_t next = 2 * part + 1; next <= 2 * part + 2 && next < work->part_count; ++next) {
        struct part *one = &work->parts[next];
        one->work = work;
        one->started = pthread_create(&one->thread, NULL, do_part, one) == 0;
    }
}

static void join_next(struct work *work, uint32_t part)
{
    for (uint32_t next = 2 * part + 1; next <= 2 * part + 2 && next < work->part_count; ++next)
        if (work->parts[next].started)
            pthread_join(work->parts[next].thread, NULL);
}

static void *do_part(void *argument)
{
    struct part *own = argument;
    const uint32_t part = (uint32_t)(own - own->work->parts);

    start_next(own->work, part);
    while (do_chunk(own->work, part)) {
    }
    join_next(own->work, part);
    return NULL;
}

// The caller's part: it also tells which rows are done.
static void do_own_part(struct work *work, vkb_rows_done *done)
{
    uint32_t reported = 0;

    while (do_chunk(work, 0)) {
        const uint32_t before = reported;
        while (reported < work->chunk_count && atomic_load(&work->done[reported]))
            ++reported;
        // The last chunk is reported when all threads have ended.
        if (done && reported > before && reported < work->chunk_count)
            done(work->context, chunk_end(work, reported - 1));
    }
}

static uint32_t part_count(const struct work *work, size_t size)
{
    size_t count = size / LEAST_SIZE;

    count = count < VKB_MAX_PARTS ? count : VKB_MAX_PARTS;
    count = count < work->chunk_count ? count : work->chunk_count;
    if (count <= 1)
        return 1;
    const uint32_t cores = core_count();
    return count < cores ? (uint32_t)count : cores;
}

static void divide(struct work *work, size_t size)
{
    const uint32_t rows = work->end - work->first;
    const size_t wanted = size / CHUNK_SIZE + 1;
    const uint32_t count = wanted < MAX_CHUNKS ? (uint32_t)wanted : MAX_CHUNKS;

    work->chunk_rows = (rows + count - 1) / count;
    work->chunk_count = (rows + work->chunk_rows - 1) / work->chunk_rows;
    atomic_init(&work->taken, 0);
    for (uint32_t i = 0; i < work->chunk_count; ++i)
        atomic_init(&work->done[i], false);
}

static void start_parts(struct work *work)
{
    sigset_t all, before;

    if (work->part_count == 1)
        return;
    // Threads inherit the mask. A signal handler of the application must not run in one of them.
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    start_next(work, 0);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
}

void vkb_in_parts(vkb_rows *rows, vkb_rows_done *done, void *context, uint32_t first, uint32_t end,
                  size_t size)
{
    struct work work = {.rows = rows, .context = context, .first = first, .end = end};

    if (first < end) {
        divide(&work, size);
        work.part_count = part_count(&work, size);
        start_parts(&work);
        do_own_part(&work, done);
        join_next(&work, 0);
    }
    if (done)
        done(context, end);
}

#endif
