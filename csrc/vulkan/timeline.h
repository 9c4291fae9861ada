// Timeline semaphores that other interfaces of the same GPU can import, and the points on them that
// submissions wait for and signal.
#ifndef VKB_TIMELINE_H
#define VKB_TIMELINE_H

#include "vulkan/error.h"

#include <volk.h>

struct vkb_device;

struct vkb_point {
    VkSemaphore semaphore;  // VK_NULL_HANDLE: none
    uint64_t value;         // 0: the semaphore is binary
};

// Between a submission and others: a screen, and CUDA.
enum vkb_neighbour { VKB_NEIGHBOUR_SCREEN, VKB_NEIGHBOUR_CUDA, VKB_NEIGHBOUR_COUNT };
struct vkb_order {
    struct vkb_point waits[VKB_NEIGHBOUR_COUNT], signals[VKB_NEIGHBOUR_COUNT];
};

// Creates a timeline semaphore at 0. *descriptor is a new descriptor of it, which belongs to the
// caller. Needs device->timelines.
bool vkb_timeline_export(const struct vkb_device *device, VkSemaphore *semaphore, int *descriptor,
                         struct vkb_error *error);

#endif
