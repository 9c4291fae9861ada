// For the count of usable cores.
#define _GNU_SOURCE

#include "vulkan/parts.h"

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <unistd.h>

enum {
    // A thread takes some 10 us to wake up, in which a core copies a hundred kilobytes.
    MIN_SIZE = 1 << 20,
    // Of the rows that a thread takes at once.
    CHUNK_SIZE = 128 << 10,
    MAX_CHUNKS = 1024,
};

struct work {
    vkb_rows *rows;
    void *context;
    uint32_t first, end, chunk_rows, chunk_count;
    atomic_uint taken;  // chunks so far
    atomic_bool done[MAX_CHUNKS];
    uint32_t part_count;
};

struct vkb_workers {
    pthread_mutex_t lock;
    pthread_cond_t wake;
    struct work *work;  // NULL: none
    uint64_t number;    // of works so far
    bool ending;
    atomic_uint busy;  // threads that may use the work
    pthread_t threads[VKB_MAX_PARTS - 1];
    uint32_t started, running;  // threads
};

uint32_t vkb_core_count(void)
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

// Until the workers end, with the lock.
static void work_on(struct vkb_workers *workers, uint32_t part)
{
    uint64_t last = 0;

    while (!workers->ending) {
        if (workers->number == last) {
            pthread_cond_wait(&workers->wake, &workers->lock);
            continue;
        }
        last = workers->number;
        struct work *work = workers->work;
        if (!work || part >= work->part_count)
            continue;
        atomic_fetch_add(&workers->busy, 1);
        pthread_mutex_unlock(&workers->lock);
        while (do_chunk(work, part)) {
        }
        atomic_fetch_sub(&workers->busy, 1);
        pthread_mutex_lock(&workers->lock);
    }
}

static void *do_parts(void *argument)
{
    struct vkb_workers *workers = argument;

    pthread_mutex_lock(&workers->lock);
    // Part 0 is the caller's.
    ++workers->running;
    work_on(workers, workers->running);
    pthread_mutex_unlock(&workers->lock);
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
    size_t count = size / MIN_SIZE;

    count = count < VKB_MAX_PARTS ? count : VKB_MAX_PARTS;
    count = count < work->chunk_count ? count : work->chunk_count;
    if (count <= 1)
        return 1;
    const uint32_t cores = vkb_core_count();
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

// Starts threads until there are enough for the work, with the lock.
static void start_workers(struct vkb_workers *workers, uint32_t part_count)
{
    sigset_t all, before;

    if (workers->started + 1 >= part_count)
        return;
    // Threads inherit the mask. A signal handler of the application must not run in one of them.
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    while (workers->started + 1 < part_count
           && pthread_create(&workers->threads[workers->started], NULL, do_parts, workers) == 0)
        ++workers->started;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
}

static void give(struct vkb_workers *workers, struct work *work)
{
    pthread_mutex_lock(&workers->lock);
    start_workers(workers, work->part_count);
    workers->work = work;
    ++workers->number;
    pthread_cond_broadcast(&workers->wake);
    pthread_mutex_unlock(&workers->lock);
}

// Waits until all have left the work, which nobody can begin any more.
static void take_back(struct vkb_workers *workers)
{
    pthread_mutex_lock(&workers->lock);
    workers->work = NULL;
    pthread_mutex_unlock(&workers->lock);
    // Each has at most a chunk left to do. To sleep would take longer.
    while (atomic_load(&workers->busy) > 0)
        sched_yield();
}

struct vkb_workers *vkb_workers_create(struct vkb_error *error)
{
    struct vkb_workers *workers = vkb_alloc(error, 1, sizeof *workers);

    // Neither can fail on Linux and macOS.
    if (workers) {
        pthread_mutex_init(&workers->lock, NULL);
        pthread_cond_init(&workers->wake, NULL);
    }
    return workers;
}

void vkb_workers_destroy(struct vkb_workers *workers)
{
    if (!workers)
        return;
    pthread_mutex_lock(&workers->lock);
    workers->ending = true;
    pthread_cond_broadcast(&workers->wake);
    pthread_mutex_unlock(&workers->lock);
    for (uint32_t i = 0; i < workers->started; ++i)
        pthread_join(workers->threads[i], NULL);
    pthread_cond_destroy(&workers->wake);
    pthread_mutex_destroy(&workers->lock);
    vkb_free(workers);
}

void vkb_in_parts(struct vkb_workers *workers, vkb_rows *rows, vkb_rows_done *done, void *context,
                  uint32_t first, uint32_t end, size_t size)
{
    struct work work = {.rows = rows, .context = context, .first = first, .end = end};

    if (first < end) {
        divide(&work, size);
        work.part_count = part_count(&work, size);
        if (work.part_count > 1)
            give(workers, &work);
        do_own_part(&work, done);
        if (work.part_count > 1)
            take_back(workers);
    }
    if (done)
        done(context, end);
}
