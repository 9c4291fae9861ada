// Named accesses to images. Stages, access masks and layouts are derived from the name. Only
// barrier.c uses stage masks.
#ifndef VKB_BARRIER_H
#define VKB_BARRIER_H

#include "vulkan/device.h"

enum vkb_access {
    VKB_ACCESS_NONE,          // not used yet, or the content is discarded
    VKB_ACCESS_COLOR_TARGET,  // written as a colour attachment, also with blending
    VKB_ACCESS_DEPTH_TARGET,
    VKB_ACCESS_SAMPLED,           // read by a fragment shader
    VKB_ACCESS_DISPATCH_SAMPLED,  // read by a compute shader, through a sampler
    VKB_ACCESS_DISPATCH_LOADED,   // read by a compute shader, as a storage image
    VKB_ACCESS_DISPATCH_STORED,   // written by a compute shader
    VKB_ACCESS_DISPATCH_CHANGED,  // loaded and stored by one compute shader
    VKB_ACCESS_RESOURCE,  // of what methods bring along: filled, read or written by any shader
    VKB_ACCESS_COPY_SOURCE,
    VKB_ACCESS_COPY_TARGET,
    VKB_ACCESS_VERTICES,   // of buffers, also of indices
    VKB_ACCESS_HOST_READ,  // of host-visible buffers, after the fence
    VKB_ACCESS_ACQUIRED,   // of a swapchain's image, whose content is discarded
    VKB_ACCESS_PRESENTED,  // the same image, handed back
    VKB_ACCESS_COUNT,
};

VkImageLayout vkb_access_layout(enum vkb_access access);
VkImageUsageFlags vkb_access_usage(enum vkb_access access);
VkPipelineStageFlags vkb_access_stages(enum vkb_access access);

// Records the barrier between two accesses: for an image with the given layouts (NULL: its layout
// stays), and with `memory` for all memory. Two equal read accesses need no barrier.
void vkb_barrier_record(const struct vkb_device *device, VkCommandBuffer commands,
                        const VkImageMemoryBarrier *image, bool memory, enum vkb_access from,
                        enum vkb_access to);

// Takes over a buffer from CUDA, from VKB_ACCESS_NONE, or hands it over, to VKB_ACCESS_PRESENTED.
void vkb_barrier_record_owner(const struct vkb_device *device, VkCommandBuffer commands,
                              VkBuffer buffer, enum vkb_access from, enum vkb_access to);

#endif
