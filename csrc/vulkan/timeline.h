// Timeline semaphores that other interfaces of the same GPU can import, and the points on them that
// submissions wait for and signal.
#ifndef VKB_TIMELINE_H
#define VKB_TIMELINE_H

#include "vulkan/error.h"

#include <volk.h>

struct vkb_device;

struct vkb_sync_point {
    VkSemaphore semaphore;  // VK_NULL_HANDLE: none
    uint64_t value;         // 0: the semaphore is binary
};

// Between a submission and others: a screen, and CUDA.
enum vkb_external_access { VKB_EXTERNAL_SCREEN, VKB_EXTERNAL_CUDA, VKB_EXTERNAL_COUNT };
struct vkb_sync {
    struct vkb_sync_point waits[VKB_EXTERNAL_COUNT], signals[VKB_EXTERNAL_COUNT];
};

// Creates a timeline semaphore at 0. *descriptor is a new descriptor of it, which belongs to the
// caller. Needs device->timelines.
bool vkb_timeline_export(const struct vkb_device *device, VkSemaphore *semaphore, int *descriptor,
                         struct vkb_error *error);

#endif
