#include "share/cuda.h"

#include "vulkan/adapter.h"

#include <stdio.h>
#include <string.h>

#include <dlfcn.h>
#include <poll.h>
#include <stdatomic.h>
#include <unistd.h>

// As in CUDA's header.
typedef int result;
enum {
    OUT_OF_MEMORY = 2,
    NOT_INITIALIZED = 3,
    STREAM_CAPTURE_IMPLICIT = 906,
    CAPTURE_MODE_RELAXED = 2,
    STREAM_NON_BLOCKING = 1,
    EVENT_DISABLE_TIMING = 2,
    HANDLE_OPAQUE_FD = 1,
    MEMORY_DEDICATED = 1,
    HANDLE_TIMELINE_FD = 9,
};

union shared_handle {
    int descriptor;
    struct {
        void *handle;
        const void *name;
    } other;
};

struct memory_handle {
    int type;
    union shared_handle handle;
    unsigned long long size;
    unsigned flags, reserved[16];
};

struct memory_buffer {
    unsigned long long offset, size;
    unsigned flags, reserved[16];
};

struct semaphore_handle {
    int type;
    union shared_handle handle;
    unsigned flags, reserved[16];
};

// CUDA has two structs of this size, for signals and for waits.
struct semaphore_point {
    unsigned long long value, others[8];
    unsigned flags, reserved[16];
};

struct uuid {
    unsigned char bytes[16];
};

#define FUNCTIONS(NAME) \
    NAME(cuInit, "cuInit", (unsigned)) \
    NAME(cuGetErrorName, "cuGetErrorName", (result, const char **)) \
    NAME(cuDeviceGetCount, "cuDeviceGetCount", (int *)) \
    NAME(cuDeviceGet, "cuDeviceGet", (int *, int)) \
    NAME(cuDeviceGetName, "cuDeviceGetName", (char *, int, int)) \
    NAME(cuDeviceGetUuid, "cuDeviceGetUuid", (struct uuid *, int)) \
    NAME(cuDevicePrimaryCtxRetain, "cuDevicePrimaryCtxRetain", (void **, int)) \
    NAME(cuDevicePrimaryCtxRelease, "cuDevicePrimaryCtxRelease_v2", (int)) \
    NAME(cuCtxPushCurrent, "cuCtxPushCurrent_v2", (void *)) \
    NAME(cuCtxPopCurrent, "cuCtxPopCurrent_v2", (void **)) \
    NAME(cuCtxSynchronize, "cuCtxSynchronize", (void)) \
    NAME(cuStreamCreate, "cuStreamCreate", (void **, unsigned)) \
    NAME(cuStreamDestroy, "cuStreamDestroy_v2", (void *)) \
    NAME(cuStreamSynchronize, "cuStreamSynchronize", (void *)) \
    NAME(cuStreamIsCapturing, "cuStreamIsCapturing", (void *, int *)) \
    NAME(cuThreadExchangeStreamCaptureMode, "cuThreadExchangeStreamCaptureMode", (int *)) \
    NAME(cuEventCreate, "cuEventCreate", (void **, unsigned)) \
    NAME(cuEventDestroy, "cuEventDestroy_v2", (void *)) \
    NAME(cuEventRecord, "cuEventRecord", (void *, void *)) \
    NAME(cuEventQuery, "cuEventQuery", (void *)) \
    NAME(cuEventSynchronize, "cuEventSynchronize", (void *)) \
    NAME(cuImportExternalMemory, "cuImportExternalMemory", \
         (void **, const struct memory_handle *)) \
    NAME(cuExternalMemoryGetMappedBuffer, "cuExternalMemoryGetMappedBuffer", \
         (vkb_cuda_address *, void *, const struct memory_buffer *)) \
    NAME(cuDestroyExternalMemory, "cuDestroyExternalMemory", (void *)) \
    NAME(cuImportExternalSemaphore, "cuImportExternalSemaphore", \
         (void **, const struct semaphore_handle *)) \
    NAME(cuDestroyExternalSemaphore, "cuDestroyExternalSemaphore", (void *)) \
    NAME(cuSignalExternalSemaphoresAsync, "cuSignalExternalSemaphoresAsync", \
         (void *const *, const struct semaphore_point *, unsigned, void *)) \
    NAME(cuWaitExternalSemaphoresAsync, "cuWaitExternalSemaphoresAsync", \
         (void *const *, const struct semaphore_point *, unsigned, void *)) \
    NAME(cuMemFree, "cuMemFree_v2", (vkb_cuda_address)) \
    NAME(cuMemcpyAsync, "cuMemcpyAsync", (vkb_cuda_address, vkb_cuda_address, size_t, void *)) \
    NAME(cuCtxRecordEvent, "cuCtxRecordEvent", (void *, void *)) \
    NAME(cuCtxWaitEvent, "cuCtxWaitEvent", (void *, void *))

struct vkb_cuda {
#define MEMBER(name, symbol, arguments) result(*name) arguments;
    FUNCTIONS(MEMBER)
#undef MEMBER
    int device, ordinal;
    void *context, *stream;
    // A stream waits for a device that was lost: what would wait for the stream is not called.
    atomic_bool stuck;
};

#ifdef VKBLOOM_FAULTS
#define RESULT(call) (vkb_fault(#call) ? OUT_OF_MEMORY : (call))
#else
#define RESULT(call) (call)
#endif
#define CU(error, call) check(cuda, (error), RESULT(call), #call)

static bool check(const struct vkb_cuda *cuda, struct vkb_error *error, result answer,
                  const char *call_text)
{
    size_t length;
    const char *call = vkb_call_name(call_text, &length), *name = NULL;

    if (answer == 0)
        return true;
    cuda->cuGetErrorName(answer, &name);
    vkb_fail(error, answer == OUT_OF_MEMORY ? VKB_ERROR_OUT_OF_MEMORY : VKB_ERROR_GENERAL,
             "CUDA: %.*s failed with %s", (int)length, call, name ? name : "an unknown error");
    if (answer == NOT_INITIALIZED)
        vkb_add_words(error, ". In a process that was forked from one with CUDA, CUDA does not "
                             "work: start processes by multiprocessing's method \"spawn\"");
    return false;
}

// The library stays open: other users of the process have it open, too.
static bool load(struct vkb_cuda *cuda, struct vkb_error *error)
{
    void *library = dlopen("libcuda.so.1", RTLD_NOW | RTLD_LOCAL), *function;

    if (!library)
        return vkb_fail(error, VKB_ERROR_GENERAL,
                        "CUDA: libcuda.so.1 does not open; arrays on the device need NVIDIA's "
                        "driver");
#define LOAD(member, symbol, arguments) \
    function = dlsym(library, symbol); \
    memcpy(&cuda->member, &function, sizeof function); \
    if (!function) \
        return vkb_fail(error, VKB_ERROR_GENERAL, \
                        "CUDA: libcuda.so.1 has no %s; CUDA 12.5 or newer is needed", symbol);
    FUNCTIONS(LOAD)
#undef LOAD
    return true;
}

void vkb_cuda_name(const struct vkb_cuda *cuda, int ordinal, char name[VKB_CUDA_NAME_SIZE])
{
    struct uuid uuid = {{0}};
    char device_name[256] = "unknown GPU", text[VKB_UUID_TEXT_SIZE];
    int device;

    if (cuda->cuDeviceGet(&device, ordinal) == 0) {
        cuda->cuDeviceGetName(device_name, sizeof device_name, device);
        cuda->cuDeviceGetUuid(&uuid, device);
    }
    vkb_uuid_text(uuid.bytes, text);
    snprintf(name, VKB_CUDA_NAME_SIZE, "%.200s (uuid:%s)", device_name, text);
}

static bool find_device(struct vkb_cuda *cuda, const uint8_t uuid[16], const char *name,
                        struct vkb_error *error)
{
    int count = 0;

    if (!CU(error, cuda->cuInit(0)) || !CU(error, cuda->cuDeviceGetCount(&count)))
        return false;
    for (cuda->ordinal = 0; cuda->ordinal < count; ++cuda->ordinal) {
        struct uuid found;
        if (!CU(error, cuda->cuDeviceGet(&cuda->device, cuda->ordinal))
            || !CU(error, cuda->cuDeviceGetUuid(&found, cuda->device)))
            return false;
        if (memcmp(found.bytes, uuid, sizeof found.bytes) == 0)
            return true;
    }
    return vkb_fail(error, VKB_ERROR_VALUE,
                    "device: the renderer is on %s, which is not among CUDA's %d GPUs. Open a "
                    "renderer with the adapter \"uuid:...\" of one of them, or use arrays on the "
                    "host",
                    name, count);
}

// What this thread's calls do to captures of graphs, while the core makes calls.
static _Thread_local int capture_mode;

// Every use of the context is between these two. Waits, imports and frees would else invalidate
// captures of any thread, which have nothing to do with the core's stream.
static bool enter(struct vkb_cuda *cuda, struct vkb_error *error)
{
    if (!CU(error, cuda->cuCtxPushCurrent(cuda->context)))
        return false;
    capture_mode = CAPTURE_MODE_RELAXED;
    cuda->cuThreadExchangeStreamCaptureMode(&capture_mode);
    return true;
}

static void leave(struct vkb_cuda *cuda)
{
    void *context;

    cuda->cuThreadExchangeStreamCaptureMode(&capture_mode);
    cuda->cuCtxPopCurrent(&context);
}

// Work of Vulkan cannot be recorded into a graph. A stream that waits for another one's event is
// captured with it.
static bool require_no_capture(struct vkb_cuda *cuda, void *stream, struct vkb_error *error)
{
    int status = 0;
    const result answer = RESULT(cuda->cuStreamIsCapturing(stream, &status));

    if (answer != STREAM_CAPTURE_IMPLICIT && status == 0)
        return check(cuda, error, answer, "cuStreamIsCapturing");
    return vkb_fail(error, VKB_ERROR_GENERAL,
                    "CUDA graph: the stream is being captured, and the renderer's work cannot be "
                    "recorded; make the call before or after the capture");
}

// As enter, to give work to the core's stream and, unless it is NULL, to another one.
static bool enter_streams(struct vkb_cuda *cuda, void *other, struct vkb_error *error)
{
    if (cuda->stuck)
        return vkb_fail(error, VKB_ERROR_DEVICE_LOST,
                        "the device was lost, and streams of CUDA wait for it");
    if (!enter(cuda, error))
        return false;
    const bool ready = require_no_capture(cuda, cuda->stream, error)
                    && (!other || require_no_capture(cuda, other, error));
    if (!ready)
        leave(cuda);
    return ready;
}

static bool make_stream(struct vkb_cuda *cuda, struct vkb_error *error)
{
    if (!enter(cuda, error))
        return false;
    const bool done = CU(error, cuda->cuStreamCreate(&cuda->stream, STREAM_NON_BLOCKING));
    leave(cuda);
    return done;
}

struct vkb_cuda *vkb_cuda_open(const uint8_t uuid[16], const char *name, struct vkb_error *error)
{
    struct vkb_cuda *cuda = vkb_alloc(error, 1, sizeof *cuda);

    if (!cuda)
        return NULL;
    if (load(cuda, error) && find_device(cuda, uuid, name, error)
        && CU(error, cuda->cuDevicePrimaryCtxRetain(&cuda->context, cuda->device))
        && make_stream(cuda, error))
        return cuda;
    vkb_cuda_close(cuda);
    return NULL;
}

void vkb_cuda_close(struct vkb_cuda *cuda)
{
    struct vkb_error ignored;

    if (!cuda)
        return;
    // Whoever ends a context waits for its streams.
    if (cuda->stream && !cuda->stuck && enter(cuda, &ignored)) {
        cuda->cuStreamDestroy(cuda->stream);
        leave(cuda);
    }
    if (cuda->context && !cuda->stuck)
        cuda->cuDevicePrimaryCtxRelease(cuda->device);
    vkb_free(cuda);
}

bool vkb_cuda_enter(struct vkb_cuda *cuda, struct vkb_error *error)
{
    return CU(error, cuda->cuCtxPushCurrent(cuda->context));
}

void vkb_cuda_leave(struct vkb_cuda *cuda)
{
    void *context;

    cuda->cuCtxPopCurrent(&context);
}

bool vkb_cuda_require_no_capture(struct vkb_cuda *cuda, struct vkb_error *error)
{
    if (!enter_streams(cuda, NULL, error))
        return false;
    leave(cuda);
    return true;
}

int vkb_cuda_ordinal(const struct vkb_cuda *cuda)
{
    return cuda->ordinal;
}

void *vkb_cuda_stream(const struct vkb_cuda *cuda)
{
    return cuda->stream;
}

static bool import(struct vkb_cuda *cuda, int descriptor, uint64_t size,
                   struct vkb_cuda_memory *memory, struct vkb_error *error)
{
    const struct memory_handle handle = {
        .type = HANDLE_OPAQUE_FD,
        .handle.descriptor = descriptor,
        .size = size,
        .flags = MEMORY_DEDICATED,
    };

    if (!CU(error, cuda->cuImportExternalMemory(&memory->handle, &handle))) {
        close(descriptor);
        return false;
    }
    return CU(error, cuda->cuExternalMemoryGetMappedBuffer(&memory->address, memory->handle,
                                                           &(struct memory_buffer){.size = size}))
        && CU(error, cuda->cuEventCreate(&memory->event, EVENT_DISABLE_TIMING));
}

bool vkb_cuda_import(struct vkb_cuda *cuda, int descriptor, uint64_t size,
                     struct vkb_cuda_memory *memory, struct vkb_error *error)
{
    *memory = (struct vkb_cuda_memory){0};
    if (!enter(cuda, error)) {
        close(descriptor);
        return false;
    }
    const bool done = import(cuda, descriptor, size, memory, error);
    leave(cuda);
    if (!done)
        vkb_cuda_free(cuda, memory);
    return done;
}

void vkb_cuda_free(struct vkb_cuda *cuda, struct vkb_cuda_memory *memory)
{
    struct vkb_error ignored;

    if (cuda->stuck || !enter(cuda, &ignored))
        return;
    // CUDA leaks the memory unless the mapped buffer is freed first.
    if (memory->address)
        cuda->cuMemFree(memory->address);
    if (memory->handle)
        cuda->cuDestroyExternalMemory(memory->handle);
    if (memory->event)
        cuda->cuEventDestroy(memory->event);
    leave(cuda);
    *memory = (struct vkb_cuda_memory){0};
}

void *vkb_cuda_import_semaphore(struct vkb_cuda *cuda, int descriptor, struct vkb_error *error)
{
    const struct semaphore_handle handle = {
        .type = HANDLE_TIMELINE_FD,
        .handle.descriptor = descriptor,
    };
    void *semaphore = NULL;
    bool done = false;

    if (enter(cuda, error)) {
        done = CU(error, cuda->cuImportExternalSemaphore(&semaphore, &handle));
        leave(cuda);
    }
    if (!done) {
        // An import takes the descriptor over.
        close(descriptor);
        return NULL;
    }
    return semaphore;
}

void vkb_cuda_free_semaphore(struct vkb_cuda *cuda, void *semaphore)
{
    struct vkb_error ignored;

    if (!enter(cuda, &ignored))
        return;
    cuda->cuDestroyExternalSemaphore(semaphore);
    leave(cuda);
}

bool vkb_cuda_signal(struct vkb_cuda *cuda, void *semaphore, uint64_t value,
                     struct vkb_error *error)
{
    const struct semaphore_point point = {.value = value};

    if (!enter_streams(cuda, NULL, error))
        return false;
    const bool done =
        CU(error, cuda->cuSignalExternalSemaphoresAsync(&semaphore, &point, 1, cuda->stream));
    leave(cuda);
    return done;
}

bool vkb_cuda_wait(struct vkb_cuda *cuda, void *semaphore, uint64_t value, void *stream,
                   struct vkb_error *error)
{
    const struct semaphore_point point = {.value = value};

    if (!enter_streams(cuda, stream, error))
        return false;
    const bool done = CU(error, cuda->cuWaitExternalSemaphoresAsync(
                                    &semaphore, &point, 1, stream ? stream : cuda->stream));
    leave(cuda);
    return done;
}

bool vkb_cuda_finish(struct vkb_cuda *cuda, struct vkb_error *error)
{
    if (!enter_streams(cuda, NULL, error))
        return false;
    const bool done = CU(error, cuda->cuStreamSynchronize(cuda->stream));
    leave(cuda);
    return done;
}

bool vkb_cuda_settle(struct vkb_cuda *cuda)
{
    struct vkb_error ignored;

    if (!enter(cuda, &ignored))
        return false;
    const bool done = cuda->cuCtxSynchronize() == 0;
    leave(cuda);
    return done;
}

// Whether all streams come to an end within some milliseconds.
static bool ends_soon(struct vkb_cuda *cuda, int milliseconds)
{
    void *event = NULL;
    bool over = false;

    if (cuda->cuEventCreate(&event, EVENT_DISABLE_TIMING) != 0)
        return false;
    if (cuda->cuCtxRecordEvent(cuda->context, event) == 0) {
        over = cuda->cuEventQuery(event) == 0;
        for (int waited = 0; !over && waited < milliseconds; ++waited) {
            poll(NULL, 0, 1);
            over = cuda->cuEventQuery(event) == 0;
        }
    }
    cuda->cuEventDestroy(event);
    return over;
}

bool vkb_cuda_settle_lost(struct vkb_cuda *cuda)
{
    enum { MILLISECONDS = 1000 };
    struct vkb_error ignored;
    bool over = false;

    if (enter(cuda, &ignored)) {
        over = ends_soon(cuda, MILLISECONDS);
        leave(cuda);
    }
    cuda->stuck = !over;
    return over;
}

bool vkb_cuda_copy(struct vkb_cuda *cuda, vkb_cuda_address to, vkb_cuda_address from, size_t size,
                   struct vkb_error *error)
{
    if (!enter_streams(cuda, NULL, error))
        return false;
    const bool begun = CU(error, cuda->cuMemcpyAsync(to, from, size, cuda->stream));
    const bool done = begun && CU(error, cuda->cuStreamSynchronize(cuda->stream));
    // The first wait may have failed for lack of memory. The caller frees the host's memory now.
    if (begun && !done)
        cuda->cuStreamSynchronize(cuda->stream);
    leave(cuda);
    return done;
}

bool vkb_cuda_begin_copy(struct vkb_cuda *cuda, struct vkb_cuda_memory *to, vkb_cuda_address from,
                         size_t size, void *stream, struct vkb_error *error)
{
    if (!enter_streams(cuda, stream, error))
        return false;
    if (!stream)
        stream = cuda->stream;
    const bool done = CU(error, cuda->cuMemcpyAsync(to->address, from, size, stream))
                   && CU(error, cuda->cuEventRecord(to->event, stream));
    leave(cuda);
    return done;
}

bool vkb_cuda_order_copy(struct vkb_cuda *cuda, const struct vkb_cuda_memory *to)
{
    struct vkb_error ignored;

    if (!enter(cuda, &ignored))
        return false;
    const bool done = cuda->cuCtxWaitEvent(cuda->context, to->event) == 0;
    leave(cuda);
    return done;
}

bool vkb_cuda_end_copy(struct vkb_cuda *cuda, const struct vkb_cuda_memory *to,
                       struct vkb_error *error)
{
    if (!enter(cuda, error))
        return false;
    const bool done = CU(error, cuda->cuEventSynchronize(to->event));
    leave(cuda);
    return done;
}

bool vkb_cuda_mark(struct vkb_cuda *cuda, struct vkb_cuda_memory *memory)
{
    struct vkb_error ignored;

    if (!enter(cuda, &ignored))
        return false;
    // Of all streams, since nothing tells on which ones the memory was used.
    const bool done = cuda->cuCtxRecordEvent(cuda->context, memory->event) == 0;
    leave(cuda);
    return done;
}

bool vkb_cuda_passed(struct vkb_cuda *cuda, struct vkb_cuda_memory *memory)
{
    struct vkb_error ignored;

    if (!enter(cuda, &ignored))
        return false;
    const bool passed = cuda->cuEventQuery(memory->event) == 0;
    leave(cuda);
    return passed;
}
