// Memory of the device that CUDA maps, too: what comes from arrays on the device, and results that
// stay there. It is kept for new arrays when an array is freed. Calls must not overlap; the core
// makes them with the GIL or vkb_memory.
#ifndef VKB_EXPORTS_H
#define VKB_EXPORTS_H

#include "run/cuda.h"
#include "vulkan/export.h"

struct vkb_export {
    struct vkb_export *previous, *next;  // in the list of taken or idle ones
    struct vkb_buffer buffer;
    struct vkb_cuda_memory memory;
    uint64_t size;
    struct vkb_cuda *cuda;
    bool filling;  // CUDA may still copy to it
};

struct vkb_exports {
    const struct vkb_device *device;  // NULL: closed
    struct vkb_cuda *cuda;
    struct vkb_export *taken, *idle;  // the latest first
    uint64_t idle_size;
};

// Opens CUDA for the device.
struct vkb_exports *vkb_exports_create(const struct vkb_device *device, struct vkb_error *error);
// Must be called before the device is destroyed, and when it has finished all work. Taken memory
// stays CUDA's until it is given back. `exports` may be NULL.
void vkb_exports_close(struct vkb_exports *exports);

// Takes at least `size` bytes, of undefined content.
struct vkb_export *vkb_exports_take(struct vkb_exports *exports, uint64_t size,
                                    struct vkb_error *error);
// Waits for a copy that vkb_cuda_begin_copy has begun. May overlap with calls for other memory.
bool vkb_export_filled(struct vkb_export *one, struct vkb_error *error);
// The device must have finished all work on it, and CUDA a copy to it. What CUDA's streams have got
// so far may still use it.
void vkb_exports_give_back(struct vkb_exports *exports, struct vkb_export *one);

#endif
