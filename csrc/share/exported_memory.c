#include "share/exported_memory.h"

#include "execute/list.h"

// Idle memory beyond this is freed, the oldest first: seven 4K images of half floats.
#define KEPT_BYTES ((uint64_t)512 << 20)
// Not so the latest, however large they are: a training step takes an image, the result, the
// cotangent and the derivative, and streams may still use those of the step before. Otherwise a
// step of a pyramid in turns with other calls took 3.2 ms in place of 2.3, since it allocated each
// time (3840 x 2160, RGB in float32, H200, 2026-11-30).
enum { KEPT_COUNT = 8 };
#define GRANULE ((uint64_t)64 << 10)
// Of memory of one granule, which is not counted there, these are kept: sums of derivatives, of
// which Bevy's steps take eight.
enum { KEPT_SMALL = 256 };

static void destroy_timeline(struct vkb_exports *exports, struct vkb_shared_timeline *timeline,
                             bool settled)
{
    // A stream may still wait for it: CUDA's part, which does not need the device, is leaked.
    if (timeline->cuda && settled)
        vkb_cuda_free_semaphore(exports->cuda, timeline->cuda);
    exports->device->vk.vkDestroySemaphore(exports->device->handle, timeline->semaphore, NULL);
    *timeline = (struct vkb_shared_timeline){0};
}

static bool create_timeline(struct vkb_exports *exports, struct vkb_shared_timeline *timeline)
{
    struct vkb_error ignored = {0};
    int descriptor;

    if (!vkb_timeline_export(exports->device, &timeline->semaphore, &descriptor, &ignored))
        return false;
    timeline->cuda = vkb_cuda_import_semaphore(exports->cuda, descriptor, &ignored);
    return timeline->cuda;
}

// Both or none: without them the host waits, so that a failure is none of the caller's.
static void share_timelines(struct vkb_exports *exports)
{
    if (!exports->device->timelines)
        return;
    const struct vkb_messages *before = vkb_messages_begin(&exports->device->messages);
    if (!create_timeline(exports, &exports->filled) || !create_timeline(exports, &exports->drawn)) {
        destroy_timeline(exports, &exports->filled, true);
        destroy_timeline(exports, &exports->drawn, true);
    }
    vkb_messages_end(before);
}

struct vkb_exports *vkb_exports_create(const struct vkb_device *device, struct vkb_error *error)
{
    struct vkb_exports *exports;

    if (!device->exports || !device->dispatch) {
        vkb_fail(error, VKB_ERROR_VALUE,
                 "device: the adapter %s cannot share memory with CUDA; use arrays on the host",
                 device->adapter.name);
        return NULL;
    }
    exports = vkb_alloc(error, 1, sizeof *exports);
    if (!exports)
        return NULL;
    exports->device = device;
    exports->users = 1;
    exports->cuda = vkb_cuda_open(device->adapter.uuid, device->adapter.name, error);
    if (exports->cuda) {
        share_timelines(exports);
        return exports;
    }
    vkb_free(exports);
    return NULL;
}

static void destroy_export(struct vkb_export *one)
{
    const struct vkb_exports *exports = one->exports;

    if (exports->device) {
        const struct vkb_messages *before = vkb_messages_begin(&exports->device->messages);
        vkb_buffer_destroy(exports->device, &one->buffer);
        vkb_messages_end(before);
    }
    vkb_free(one);
}

static struct vkb_export *create_export(struct vkb_exports *exports, uint64_t size,
                                        struct vkb_error *error)
{
    struct vkb_export *one = vkb_alloc(error, 1, sizeof *one);
    int descriptor;

    if (!one)
        return NULL;
    one->size = (size + GRANULE - 1) / GRANULE * GRANULE;
    one->exports = exports;
    const struct vkb_messages *before = vkb_messages_begin(&exports->device->messages);
    const bool done =
        vkb_buffer_export(exports->device, one->size, &one->buffer, &descriptor, error);
    vkb_messages_end(before);
    if (done && vkb_cuda_import(exports->cuda, descriptor, one->buffer.size, &one->memory, error))
        return one;
    vkb_cuda_free(exports->cuda, &one->memory);
    destroy_export(one);
    return NULL;
}

// The smallest that is up to an eighth too large and that no stream uses any more. Memory whose
// last use is not known to be over is never used again.
static struct vkb_export *find_idle(const struct vkb_exports *exports, uint64_t size)
{
    struct vkb_export *found = NULL;

    // All of them, since what is marked earlier is over earlier.
    for (struct vkb_export *one = exports->idle; one; one = one->next)
        one->marked = one->marked || vkb_cuda_mark(exports->cuda, &one->memory);
    for (struct vkb_export *one = exports->idle; one; one = one->next)
        if (one->size >= size && one->size - size <= size / 8 + GRANULE
            && (!found || one->size < found->size) && one->marked
            && vkb_cuda_passed(exports->cuda, &one->memory))
            found = one;
    return found;
}

static bool is_small(const struct vkb_export *one)
{
    return one->size <= GRANULE;
}

// Memory has become idle, or was.
static void count_idle(struct vkb_exports *exports, const struct vkb_export *one, bool added)
{
    size_t *count = is_small(one) ? &exports->small_count : &exports->idle_count;
    const uint64_t size = is_small(one) ? 0 : one->size;

    *count = added ? *count + 1 : *count - 1;
    exports->idle_size = added ? exports->idle_size + size : exports->idle_size - size;
}

static void unlink_idle(struct vkb_exports *exports, struct vkb_export *one)
{
    VKB_UNLINK(&exports->idle, one);
    count_idle(exports, one, false);
    VKB_PUSH(&exports->taken, one);
}

struct vkb_export *vkb_exports_take(struct vkb_exports *exports, uint64_t size,
                                    struct vkb_error *error)
{
    // Marks make captures of graphs invalid.
    if (!vkb_cuda_require_no_capture(exports->cuda, error))
        return NULL;
    struct vkb_export *one = find_idle(exports, size);

    if (one)
        unlink_idle(exports, one);
    else if ((one = create_export(exports, size, error)))
        VKB_PUSH(&exports->taken, one);
    else
        return NULL;
    one->marked = false;
    one->filled = one->drawn = 0;
    one->origin_size = 0;
    vkb_export_renew(one);
    return one;
}

void vkb_export_renew(struct vkb_export *one)
{
    one->serial = ++one->exports->serials;
}

bool vkb_export_order_copy(struct vkb_export *one)
{
    struct vkb_shared_timeline *timeline = &one->exports->filled;
    struct vkb_error ignored;

    if (!timeline->semaphore || !vkb_cuda_order_copy(one->exports->cuda, &one->memory)
        || !vkb_cuda_signal(one->exports->cuda, timeline->cuda, timeline->value + 1, &ignored))
        return false;
    one->filled = ++timeline->value;
    return true;
}

void vkb_export_wait(const struct vkb_export *one, struct vkb_sync_point *point)
{
    if (one->filled > point->value)
        *point = (struct vkb_sync_point){one->exports->filled.semaphore, one->filled};
}

void vkb_export_signal(const struct vkb_export *one, struct vkb_sync_point *point)
{
    struct vkb_shared_timeline *timeline = &one->exports->drawn;

    if (timeline->semaphore)
        *point = (struct vkb_sync_point){timeline->semaphore, ++timeline->value};
}

bool vkb_export_drawn(const struct vkb_export *one, void *stream, struct vkb_error *error)
{
    const struct vkb_exports *exports = one->exports;

    if (!one->drawn)
        return true;
    if (exports->lost || exports->device->lost)
        return vkb_fail(error, VKB_ERROR_DEVICE_LOST,
                        "the device was lost before the framebuffer was complete");
    return vkb_cuda_wait(exports->cuda, exports->drawn.cuda, one->drawn, stream, error);
}

void vkb_exports_complete(struct vkb_exports *exports)
{
    // What a lost device has not signalled it has not drawn.
    if (!exports || exports->device->lost)
        return;
    for (struct vkb_export *one = exports->taken; one; one = one->next)
        one->drawn = 0;
}

bool vkb_exports_settle(const struct vkb_exports *exports)
{
    if (!exports || !exports->filled.semaphore)
        return true;
    return exports->device->lost ? vkb_cuda_settle_lost(exports->cuda)
                                 : vkb_cuda_settle(exports->cuda);
}

// The mark is for the next call that takes memory, which knows of captures of graphs: this one runs
// wherever an array is collected.
void vkb_exports_give_back(struct vkb_exports *exports, struct vkb_export *one)
{
    VKB_UNLINK(&exports->taken, one);
    VKB_PUSH(&exports->idle, one);
    count_idle(exports, one, true);
}

struct vkb_export *vkb_exports_surplus(struct vkb_exports *exports, bool all)
{
    const bool any = all || !exports->device;
    const bool many = exports->idle_size > KEPT_BYTES && exports->idle_count > KEPT_COUNT;
    const bool many_small = exports->small_count > KEPT_SMALL;
    struct vkb_export *oldest = NULL;

    for (struct vkb_export *one = exports->idle; one; one = one->next)
        if (any || (is_small(one) ? many_small : many))
            oldest = one;
    if (oldest)
        unlink_idle(exports, oldest);
    return oldest;
}

void vkb_exports_remove(struct vkb_export *one)
{
    VKB_UNLINK(&one->exports->taken, one);
    destroy_export(one);
}

void vkb_exports_free(struct vkb_exports *exports)
{
    vkb_cuda_close(exports->cuda);
    vkb_free(exports);
}

void vkb_exports_close(struct vkb_exports *exports, bool settled)
{
    for (struct vkb_export *one = exports->idle; one; one = one->next)
        vkb_buffer_destroy(exports->device, &one->buffer);
    for (struct vkb_export *one = exports->taken; one; one = one->next)
        vkb_buffer_destroy(exports->device, &one->buffer);
    destroy_timeline(exports, &exports->filled, settled);
    destroy_timeline(exports, &exports->drawn, settled);
    exports->lost = exports->device->lost;
    exports->device = NULL;
}
