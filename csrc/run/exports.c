#include "run/exports.h"

// The most idle memory that is kept, the latest first: seven 4K images of half floats.
#define KEPT_BYTES ((uint64_t)512 << 20)
#define GRANULE    ((uint64_t)64 << 10)

struct vkb_exports *vkb_exports_create(const struct vkb_device *device, struct vkb_error *error)
{
    struct vkb_exports *exports;

    if (!device->exports) {
        vkb_fail(error, VKB_ERROR_VALUE,
                 "device: the adapter %s cannot share memory with CUDA; use arrays on the host",
                 device->adapter.name);
        return NULL;
    }
    exports = vkb_alloc(error, 1, sizeof *exports);
    if (!exports)
        return NULL;
    exports->device = device;
    exports->cuda = vkb_cuda_open(device->adapter.uuid, device->adapter.name, error);
    if (exports->cuda)
        return exports;
    vkb_free(exports);
    return NULL;
}

static void destroy_export(struct vkb_exports *exports, struct vkb_export *one)
{
    vkb_cuda_free(exports->cuda, &one->memory);
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
    one->cuda = exports->cuda;
    const struct vkb_messages *before = vkb_messages_begin(&exports->device->messages);
    const bool done =
        vkb_buffer_export(exports->device, one->size, &one->buffer, &descriptor, error);
    vkb_messages_end(before);
    if (done && vkb_cuda_import(exports->cuda, descriptor, one->buffer.size, &one->memory, error))
        return one;
    destroy_export(exports, one);
    return NULL;
}

static void push(struct vkb_export **list, struct vkb_export *one)
{
    one->previous = NULL;
    one->next = *list;
    if (one->next)
        one->next->previous = one;
    *list = one;
}

static void unlink_export(struct vkb_export **list, struct vkb_export *one)
{
    if (one->previous)
        one->previous->next = one->next;
    else
        *list = one->next;
    if (one->next)
        one->next->previous = one->previous;
}

// The smallest that is up to an eighth too large and that no stream uses any more.
static struct vkb_export *find_idle(const struct vkb_exports *exports, uint64_t size)
{
    struct vkb_export *found = NULL;

    for (struct vkb_export *one = exports->idle; one; one = one->next)
        if (one->size >= size && one->size - size <= size / 8 + GRANULE
            && (!found || one->size < found->size) && vkb_cuda_passed(exports->cuda, &one->memory))
            found = one;
    return found;
}

static void drop_oldest(struct vkb_exports *exports)
{
    struct vkb_export *oldest = exports->idle;

    while (oldest->next)
        oldest = oldest->next;
    unlink_export(&exports->idle, oldest);
    exports->idle_size -= oldest->size;
    destroy_export(exports, oldest);
}

struct vkb_export *vkb_exports_take(struct vkb_exports *exports, uint64_t size,
                                    struct vkb_error *error)
{
    struct vkb_export *one = find_idle(exports, size);

    if (one) {
        unlink_export(&exports->idle, one);
        exports->idle_size -= one->size;
    } else if (!(one = create_export(exports, size, error))) {
        return NULL;
    }
    push(&exports->taken, one);
    return one;
}

bool vkb_export_filled(struct vkb_export *one, struct vkb_error *error)
{
    one->filling = one->filling && !vkb_cuda_end_copy(one->cuda, &one->memory, error);
    return !one->filling;
}

// A closed object is freed with its last memory.
static void free_closed(struct vkb_exports *exports)
{
    if (exports->device || exports->taken)
        return;
    vkb_cuda_close(exports->cuda);
    vkb_free(exports);
}

void vkb_exports_give_back(struct vkb_exports *exports, struct vkb_export *one)
{
    unlink_export(&exports->taken, one);
    if (!exports->device) {
        destroy_export(exports, one);
        free_closed(exports);
        return;
    }
    vkb_cuda_mark(exports->cuda, &one->memory);
    push(&exports->idle, one);
    exports->idle_size += one->size;
    while (exports->idle_size > KEPT_BYTES)
        drop_oldest(exports);
}

void vkb_exports_close(struct vkb_exports *exports)
{
    if (!exports)
        return;
    while (exports->idle)
        drop_oldest(exports);
    for (struct vkb_export *one = exports->taken; one; one = one->next)
        vkb_buffer_destroy(exports->device, &one->buffer);
    exports->device = NULL;
    free_closed(exports);
}
