// Memory of the device that CUDA maps, too: what comes from arrays on the device, and results that
// stay there. It is kept for new arrays when an array is freed. Calls must not overlap; the core
// makes them with the GIL or vkb_memory.
#ifndef VKB_EXPORTS_H
#define VKB_EXPORTS_H

#include "share/cuda.h"
#include "vulkan/memory.h"

struct vkb_export {
    struct vkb_export *previous, *next;  // in the list of taken or idle ones
    struct vkb_buffer buffer;
    struct vkb_cuda_memory memory;
    uint64_t size;
    struct vkb_exports *exports;
    uint64_t serial;  // of its content
    bool marked;      // of an idle one: its event tells when its last use is over
    // The points at which CUDA has filled it and the device has drawn to it. 0: it was waited for.
    uint64_t filled, drawn;
    // What CUDA is to copy to it before it is used; of 0 bytes: nothing.
    vkb_cuda_address origin;
    size_t origin_size;
    void *origin_stream;  // NULL: the core's
};

// A timeline of Vulkan that CUDA shares. `value` is the last point that was given away.
struct vkb_shared_timeline {
    VkSemaphore semaphore;  // VK_NULL_HANDLE: there is none; the host waits instead
    void *cuda;
    uint64_t value;
};

struct vkb_exports {
    const struct vkb_device *device;  // NULL: closed
    bool lost;                        // of closed ones: the device was lost
    uint32_t users;                   // which include the renderer
    struct vkb_cuda *cuda;
    struct vkb_export *taken, *idle;  // the latest first
    uint64_t idle_size;
    size_t idle_count, small_count;  // small ones are not in the former two
    uint64_t serials;                // given away so far
    // Signalled by CUDA; and by the device, whose points are given away with the renderer's lock.
    struct vkb_shared_timeline filled, drawn;
};

// Opens CUDA for the device. The caller is the first user.
struct vkb_exports *vkb_exports_create(const struct vkb_device *device, struct vkb_error *error);
// Must be called before the device is destroyed, and when it has finished all work. Taken memory
// stays CUDA's until it is given back. `settled`: what vkb_exports_settle returned.
void vkb_exports_close(struct vkb_exports *exports, bool settled);

// Each taken memory has a user, and so has each call that leaves the lock. The last one of closed
// exports frees them with vkb_exports_free, without the lock: true.
void vkb_exports_free(struct vkb_exports *exports);

// Takes at least `size` bytes, of undefined content.
struct vkb_export *vkb_exports_take(struct vkb_exports *exports, uint64_t size,
                                    struct vkb_error *error);
// Gives it another serial, since its content changes.
void vkb_export_renew(struct vkb_export *one);
// Lets CUDA signal that the copy which vkb_cuda_begin_copy has begun is complete. False: the host
// has to wait, since CUDA cannot order it with the work of other streams.
bool vkb_export_order_copy(struct vkb_export *one);
// The point of the copy, if it is later than `point` and the host has not waited for it.
void vkb_export_wait(const struct vkb_export *one, struct vkb_sync_point *point);
// The next point of the device's work, with the renderer's lock; none without timelines.
void vkb_export_signal(const struct vkb_export *one, struct vkb_sync_point *point);
// Makes a stream of CUDA wait until the device has drawn to the memory; NULL: CUDA's own stream
// here. Fails if the device was lost before.
bool vkb_export_drawn(const struct vkb_export *one, void *stream, struct vkb_error *error);

// The device has finished everything, unless it was lost: no stream has to wait any more. May be
// NULL, as below.
void vkb_exports_complete(struct vkb_exports *exports);
// Waits until CUDA has done all work of the context, before the timelines are destroyed. May
// overlap with other calls. May fail, as vkb_cuda_settle and, of a lost device, as
// vkb_cuda_settle_lost.
bool vkb_exports_settle(const struct vkb_exports *exports);
// The device must have finished all work on it, and CUDA a copy to it. What CUDA's streams have got
// so far may still use it.
void vkb_exports_give_back(struct vkb_exports *exports, struct vkb_export *one);

// Idle memory that is not kept, or any with `all`, taken; NULL: none. The caller frees its `memory`
// with vkb_cuda_free, which waits and so needs no lock, and then removes it.
struct vkb_export *vkb_exports_surplus(struct vkb_exports *exports, bool all);
void vkb_exports_remove(struct vkb_export *one);

#endif
