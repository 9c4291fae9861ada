// A stand-in for libcuda.so.1: one GPU, whose UUID is STAND_IN_UUID and whose memory is the host's.
// It imports the memory that lavapipe exports by mapping its descriptor. With STAND_IN_LOG, it
// writes what is left at the end to that file. The work of its stream is done in a thread; other
// streams are the host's, whose work is done at once.
//
// Tests make calls fail, put callbacks into the stream and capture one of the host's streams into a
// graph, with functions that CUDA does not have. What NVIDIA's driver 580 does to captures was
// tried.
#include <limits.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#define EXPORT __attribute__((visibility("default")))

enum {
    SUCCESS,
    INVALID_VALUE,
    OUT_OF_MEMORY,
    INVALID_DEVICE = 101,
    NOT_READY = 600,
    CAPTURE_UNSUPPORTED = 900,
};
enum { CAPTURE_MODE_GLOBAL = 0 };
#define DEFAULT_STREAM ((void *)(uintptr_t)1)

// What is there now, by kind; and bytes that go to the host.
static _Atomic long contexts, streams, events, memories, mappings, host_bytes, current;
// Each thread has its own stack of contexts.
static _Thread_local long current_here;
static _Thread_local int capture_mode_here;

// The capture of a stream: whether the stream of the core is a part of it, and whether a call has
// made it invalid.
static struct {
    void *stream;  // NULL: none
    _Atomic int joined, invalid;
} capture;

struct event {
    int captured;
    unsigned long after;  // so much work of the stream
};

// Names of the functions that fail.
static char failing[128];
// The most memories that are imported at once.
static _Atomic long most_memories = LONG_MAX;

// Calls for the whole context make captures invalid; others do unless the thread's mode is relaxed.
static int refuses(const char *name, int whole)
{
    const int captured = capture.stream && (whole || capture_mode_here == CAPTURE_MODE_GLOBAL);

    capture.invalid |= captured;
    return captured ? CAPTURE_UNSUPPORTED : strstr(failing, name) ? OUT_OF_MEMORY : SUCCESS;
}
#define REFUSE(whole) \
    do { \
        const int answer = refuses(__func__, whole); \
        if (answer) \
            return answer; \
    } while (0)

struct memory_handle {
    int type;
    union {
        int descriptor;
        void *others[2];
    } handle;
    unsigned long long size;
    unsigned flags, reserved[16];
};

static struct memory {
    struct memory *next;
    char *start;
    size_t size;
    int descriptor;
} *imported;

// A timeline semaphore of the layer (lesser_device.c), as it describes itself in a file.
struct semaphore {
    void (*signal)(void *device, uint64_t semaphore, uint64_t value);
    void (*wait)(void *device, uint64_t semaphore, uint64_t value);
    void *device;
    uint64_t semaphore;
};

struct semaphore_handle {
    int type;
    union {
        int descriptor;
        void *others[2];
    } handle;
    unsigned flags, reserved[16];
};

struct semaphore_point {
    unsigned long long value, others[8];
    unsigned flags, reserved[16];
};

// The work of the stream, which a thread does in order.
struct work {
    void *to;  // NULL: no copy
    const void *from;
    size_t size;
    struct semaphore *signal, *wait;  // NULL: none
    uint64_t value;
    void (*callback)(void);  // NULL: none
};

enum { MAX_WORK = 64 };

static struct {
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    struct work work[MAX_WORK];
    unsigned first, count;
    unsigned long done;
    int started;
} queue = {.mutex = PTHREAD_MUTEX_INITIALIZER, .changed = PTHREAD_COND_INITIALIZER};

static void do_work(const struct work *work)
{
    if (work->callback)
        work->callback();
    if (work->to) {
        usleep(5000);  // so that whoever should wait for it and does not is found
        memcpy(work->to, work->from, work->size);
    }
    if (work->wait)
        work->wait->wait(work->wait->device, work->wait->semaphore, work->value);
    if (work->signal)
        work->signal->signal(work->signal->device, work->signal->semaphore, work->value);
}

static void *work_off(void *unused)
{
    (void)unused;
    pthread_mutex_lock(&queue.mutex);
    for (;;) {
        while (queue.count == 0)
            pthread_cond_wait(&queue.changed, &queue.mutex);
        const struct work work = queue.work[queue.first];
        pthread_mutex_unlock(&queue.mutex);
        do_work(&work);
        pthread_mutex_lock(&queue.mutex);
        queue.first = (queue.first + 1) % MAX_WORK;
        --queue.count;
        ++queue.done;
        pthread_cond_broadcast(&queue.changed);
    }
    return NULL;
}

static void push(struct work work)
{
    pthread_t thread;

    // What is captured there is not joined with the other stream.
    capture.invalid |= capture.joined;
    pthread_mutex_lock(&queue.mutex);
    if (!queue.started++ && pthread_create(&thread, NULL, work_off, NULL) == 0)
        pthread_detach(thread);
    while (queue.count == MAX_WORK)
        pthread_cond_wait(&queue.changed, &queue.mutex);
    queue.work[(queue.first + queue.count++) % MAX_WORK] = work;
    pthread_cond_broadcast(&queue.changed);
    pthread_mutex_unlock(&queue.mutex);
}

static unsigned long pushed(void)
{
    pthread_mutex_lock(&queue.mutex);
    const unsigned long work = queue.done + queue.count;
    pthread_mutex_unlock(&queue.mutex);
    return work;
}

static void finish(void)
{
    const unsigned long work = pushed();

    pthread_mutex_lock(&queue.mutex);
    while (queue.done < work)
        pthread_cond_wait(&queue.changed, &queue.mutex);
    pthread_mutex_unlock(&queue.mutex);
}

static void report(void)
{
    const char *path = getenv("STAND_IN_LOG");
    FILE *file = path ? fopen(path, "w") : NULL;

    if (!file)
        return;
    fprintf(file, "%ld %ld %ld %ld %ld %ld %ld\n", contexts, streams, events, memories, mappings,
            current, host_bytes);
    fclose(file);
}

static void (*at_init)(void);

static void *call_at_init(void *unused)
{
    at_init();
    return unused;
}

EXPORT int cuInit(unsigned flags)
{
    static _Atomic int known;
    pthread_t thread;

    if (!known++)
        atexit(report);
    if (at_init && pthread_create(&thread, NULL, call_at_init, NULL) == 0)
        pthread_join(thread, NULL);
    return flags ? INVALID_VALUE : SUCCESS;
}

EXPORT int cuGetErrorName(int error, const char **name)
{
    *name = error == OUT_OF_MEMORY ? "CUDA_ERROR_OUT_OF_MEMORY" : "CUDA_ERROR_OF_THE_STAND_IN";
    return SUCCESS;
}

EXPORT int cuDeviceGetCount(int *count)
{
    *count = 2;
    return SUCCESS;
}

EXPORT int cuDeviceGet(int *device, int ordinal)
{
    *device = ordinal;
    return ordinal >= 0 && ordinal < 2 ? SUCCESS : INVALID_DEVICE;
}

EXPORT int cuDeviceGetName(char *name, int size, int device)
{
    snprintf(name, (size_t)size, "Stand-in %d", device);
    return SUCCESS;
}

// The first device is another one, so that the renderer's is not found by chance.
EXPORT int cuDeviceGetUuid(unsigned char uuid[16], int device)
{
    const char *text = getenv("STAND_IN_UUID");

    memset(uuid, 0xee, 16);
    for (int i = 0; device == 1 && text && i < 16; ++i) {
        unsigned byte;
        text += *text == '-';
        sscanf(text, "%2x", &byte);
        uuid[i] = (unsigned char)byte;
        text += 2;
    }
    return SUCCESS;
}

EXPORT int cuDevicePrimaryCtxRetain(void **context, int device)
{
    ++contexts;
    *context = &contexts;
    return device == 1 ? SUCCESS : INVALID_DEVICE;
}

EXPORT int cuDevicePrimaryCtxRelease_v2(int device)
{
    --contexts;
    return device == 1 ? SUCCESS : INVALID_DEVICE;
}

EXPORT int cuCtxPushCurrent_v2(void *context)
{
    ++current;
    ++current_here;
    return context == &contexts ? SUCCESS : INVALID_VALUE;
}

EXPORT int cuCtxPopCurrent_v2(void **context)
{
    --current;
    --current_here;
    *context = &contexts;
    return SUCCESS;
}

EXPORT int cuCtxSynchronize(void)
{
    REFUSE(1);
    finish();
    return SUCCESS;
}

EXPORT int cuStreamCreate(void **stream, unsigned flags)
{
    ++streams;
    *stream = &streams;
    return flags == 1 ? SUCCESS : INVALID_VALUE;
}

EXPORT int cuStreamDestroy_v2(void *stream)
{
    --streams;
    return stream == &streams ? SUCCESS : INVALID_VALUE;
}

EXPORT int cuStreamSynchronize(void *stream)
{
    REFUSE(0);
    finish();
    return stream == &streams ? SUCCESS : INVALID_VALUE;
}

EXPORT int cuStreamWaitEvent(void *stream, void *event, unsigned flags)
{
    if (event && ((struct event *)event)->captured && stream == &streams)
        capture.joined = 1;
    return stream && event && !flags ? SUCCESS : INVALID_VALUE;
}

EXPORT int cuStreamIsCapturing(void *stream, int *status)
{
    *status =
        capture.stream && (stream == capture.stream || (stream == &streams && capture.joined));
    return SUCCESS;
}

EXPORT int cuThreadExchangeStreamCaptureMode(int *mode)
{
    const int before = capture_mode_here;

    capture_mode_here = *mode;
    *mode = before;
    return SUCCESS;
}

EXPORT int cuEventCreate(void **event, unsigned flags)
{
    *event = calloc(1, sizeof(struct event));
    if (*event)
        ++events;
    return *event && flags == 2 ? SUCCESS : INVALID_VALUE;
}

EXPORT int cuEventDestroy_v2(void *event)
{
    --events;
    free(event);
    return SUCCESS;
}

EXPORT int cuEventRecord(void *event, void *stream)
{
    *(struct event *)event = (struct event){capture.stream && stream == capture.stream, pushed()};
    return event && stream ? SUCCESS : INVALID_VALUE;
}

EXPORT int cuEventQuery(void *event)
{
    REFUSE(0);
    pthread_mutex_lock(&queue.mutex);
    const int busy = queue.done < ((struct event *)event)->after;
    pthread_mutex_unlock(&queue.mutex);
    return busy ? NOT_READY : event ? SUCCESS : INVALID_VALUE;
}

EXPORT int cuEventSynchronize(void *event)
{
    REFUSE(0);
    finish();
    return event ? SUCCESS : INVALID_VALUE;
}

EXPORT int cuCtxRecordEvent(void *context, void *event)
{
    REFUSE(1);
    *(struct event *)event = (struct event){0, pushed()};
    return context == &contexts && event ? SUCCESS : INVALID_VALUE;
}

// Tests leave the sources of copies as they are, so that nothing of the host has to wait.
EXPORT int cuCtxWaitEvent(void *context, void *event)
{
    REFUSE(1);
    return context == &contexts && event ? SUCCESS : INVALID_VALUE;
}

EXPORT int cuImportExternalMemory(void **handle, const struct memory_handle *given)
{
    struct memory *memory = calloc(1, sizeof *memory);
    struct stat about;

    REFUSE(0);
    if (memories >= most_memories) {
        free(memory);
        return OUT_OF_MEMORY;
    }
    if (!memory || given->type != 1 || given->flags != 1
        || fstat(given->handle.descriptor, &about) != 0) {
        free(memory);
        return INVALID_VALUE;
    }
    memory->size = (size_t)about.st_size;
    memory->descriptor = given->handle.descriptor;
    *handle = memory;
    ++memories;
    return SUCCESS;
}

// Mesa's anonymous files begin with their size and the offset of what was allocated.
EXPORT int cuExternalMemoryGetMappedBuffer(unsigned long long *address, void *handle,
                                           const unsigned long long *buffer)
{
    struct memory *memory = handle;
    size_t header[2];

    memory->start =
        mmap(NULL, memory->size, PROT_READ | PROT_WRITE, MAP_SHARED, memory->descriptor, 0);
    if (memory->start == MAP_FAILED)
        return OUT_OF_MEMORY;
    memcpy(header, memory->start, sizeof header);
    if (header[1] + buffer[0] + buffer[1] > memory->size)
        return INVALID_VALUE;
    *address = (unsigned long long)(uintptr_t)(memory->start + header[1] + buffer[0]);
    ++mappings;
    pthread_mutex_lock(&queue.mutex);
    memory->next = imported;
    imported = memory;
    pthread_mutex_unlock(&queue.mutex);
    return SUCCESS;
}

EXPORT int cuMemFree_v2(unsigned long long address)
{
    REFUSE(0);
    finish();
    --mappings;
    return address ? SUCCESS : INVALID_VALUE;
}

EXPORT int cuDestroyExternalMemory(void *handle)
{
    struct memory *memory = handle;

    pthread_mutex_lock(&queue.mutex);
    for (struct memory **link = &imported; *link; link = &(*link)->next)
        if (*link == memory) {
            *link = memory->next;
            break;
        }
    pthread_mutex_unlock(&queue.mutex);
    if (memory->start)
        munmap(memory->start, memory->size);
    close(memory->descriptor);
    free(memory);
    --memories;
    return SUCCESS;
}

// Whether the address lies in memory that was imported.
static int is_imported(const char *address)
{
    int found = 0;

    pthread_mutex_lock(&queue.mutex);
    for (const struct memory *memory = imported; memory; memory = memory->next)
        found |= (size_t)(address - memory->start) < memory->size;
    pthread_mutex_unlock(&queue.mutex);
    return found;
}

// What goes to other memory is counted as the host's.
EXPORT int cuMemcpyAsync(unsigned long long to, unsigned long long from, size_t size, void *stream)
{
    if (!is_imported((const char *)(uintptr_t)to))
        host_bytes += (long)size;
    push((struct work){
        .to = (void *)(uintptr_t)to,
        .from = (const void *)(uintptr_t)from,
        .size = size,
    });
    return stream == &streams || stream == DEFAULT_STREAM ? SUCCESS : INVALID_VALUE;
}

EXPORT int cuImportExternalSemaphore(void **handle, const struct semaphore_handle *given)
{
    struct semaphore *semaphore = calloc(1, sizeof *semaphore);
    const int descriptor = given->handle.descriptor;

    if (!semaphore || given->type != 9 || given->flags
        || pread(descriptor, semaphore, sizeof *semaphore, 0) != sizeof *semaphore) {
        free(semaphore);
        return INVALID_VALUE;
    }
    close(descriptor);
    *handle = semaphore;
    ++memories;
    return SUCCESS;
}

EXPORT int cuDestroyExternalSemaphore(void *handle)
{
    --memories;
    free(handle);
    return SUCCESS;
}

EXPORT int cuSignalExternalSemaphoresAsync(void *const *semaphores,
                                           const struct semaphore_point *points, unsigned count,
                                           void *stream)
{
    push((struct work){.signal = semaphores[0], .value = points[0].value});
    return count == 1 && stream == &streams ? SUCCESS : INVALID_VALUE;
}

EXPORT int cuWaitExternalSemaphoresAsync(void *const *semaphores,
                                         const struct semaphore_point *points, unsigned count,
                                         void *stream)
{
    const struct work work = {.wait = semaphores[0], .value = points[0].value};

    if (stream == &streams)
        push(work);
    else
        do_work(&work);
    return count == 1 && stream ? SUCCESS : INVALID_VALUE;
}

// Not of CUDA: these functions fail, ones of the names in the text.
EXPORT void stand_in_fail(const char *names)
{
    snprintf(failing, sizeof failing, "%s", names);
}

// Not of CUDA: no more memories are imported than there are now; 0: as many as are asked for.
EXPORT void stand_in_fill(int on)
{
    most_memories = on ? memories : LONG_MAX;
}

// Not of CUDA: begins a capture of a stream; NULL: ends it. Whether the last one was valid.
EXPORT int stand_in_capture(void *stream)
{
    const int valid = !capture.invalid;

    capture.stream = stream;
    capture.joined = capture.invalid = 0;
    return valid;
}

// Not of CUDA: puts a callback into the stream.
EXPORT void stand_in_callback(void (*callback)(void))
{
    push((struct work){.callback = callback});
}

// Not of CUDA: cuInit waits for a callback in another thread; NULL: for none.
EXPORT void stand_in_at_init(void (*callback)(void))
{
    at_init = callback;
}

static _Atomic int held;

static void hold(void)
{
    while (held)
        usleep(1000);
}

// Not of CUDA: the stream does not go on until it is let go.
EXPORT void stand_in_hold(int on)
{
    held = on;
    if (on)
        push((struct work){.callback = hold});
}

// Not of CUDA: how many contexts are current in this thread.
EXPORT long stand_in_current(void)
{
    return current_here;
}

// Not of CUDA: the bytes so far.
EXPORT long stand_in_host_bytes(void)
{
    return host_bytes;
}
