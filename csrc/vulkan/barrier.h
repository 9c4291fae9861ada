// Named accesses to images. Stages, access masks and layouts are derived from the name. Only
// barrier.c uses stage masks.
#ifndef VKB_BARRIER_H
#define VKB_BARRIER_H

#include "vulkan/device.h"

enum vkb_access {
    VKB_ACCESS_NONE,          // not used yet, or the content is discarded
    VKB_ACCESS_COLOR_TARGET,  // written as a colour attachment
    VKB_ACCESS_COLOR_BLEND,   // the same, with blending
    VKB_ACCESS_DEPTH_TARGET,
    VKB_ACCESS_SAMPLED,           // read by a fragment shader
    VKB_ACCESS_DISPATCH_SAMPLED,  // read by a compute shader, through a sampler
    VKB_ACCESS_DISPATCH_LOADED,   // read by a compute shader, as a storage image
    VKB_ACCESS_DISPATCH_STORED,   // written by a compute shader
    VKB_ACCESS_DISPATCH_CHANGED,  // loaded and stored by one compute shader
    VKB_ACCESS_ANY_READ,          // read by any shader or by a copy, in the general layout
    VKB_ACCESS_RESOURCE,  // of what methods bring along: filled, read or written by any shader
    VKB_ACCESS_COPY_SOURCE,
    VKB_ACCESS_COPY_TARGET,
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

// Makes copies and stores to host-visible buffers available to the host after the fence.
void vkb_barrier_record_host_read(const struct vkb_device *device, VkCommandBuffer commands);

// Makes copies to buffers visible to vertex input.
void vkb_barrier_record_upload(const struct vkb_device *device, VkCommandBuffer commands);

// Takes over a buffer that CUDA has written, for dispatches and copies; hands one over to CUDA
// after `from`.
void vkb_barrier_record_acquire(const struct vkb_device *device, VkCommandBuffer commands,
                                VkBuffer buffer);
void vkb_barrier_record_release(const struct vkb_device *device, VkCommandBuffer commands,
                                VkBuffer buffer, enum vkb_access from);

// The accesses to one attachment before, during and after a render pass. NONE after it: the next
// user of the image records a barrier.
struct vkb_target_use {
    enum vkb_access before, during, after;
};

enum { VKB_MAX_DEPENDENCIES = 10 };  // two for each of up to five attachments

// Writes the subpass dependencies of a render pass with these attachments, without duplicates.
// Returns their number.
uint32_t vkb_subpass_dependencies(const struct vkb_target_use *uses, uint32_t use_count,
                                  VkSubpassDependency *dependencies);

#endif
