// What is done with an image, by name; stages, access masks and layouts are derived from the name.
// The only place of the core that knows stage masks.
#ifndef VKB_BARRIER_H
#define VKB_BARRIER_H

#include "vulkan/device.h"

enum vkb_access {
    VKB_ACCESS_NONE,          // never used, or what it held does not matter
    VKB_ACCESS_COLOR_TARGET,  // written as a colour attachment
    VKB_ACCESS_COLOR_BLEND,   // the same, reading what is there
    VKB_ACCESS_DEPTH_TARGET,
    VKB_ACCESS_SAMPLED,           // read by a fragment shader
    VKB_ACCESS_DISPATCH_SAMPLED,  // read by a compute shader, through a sampler
    VKB_ACCESS_DISPATCH_LOADED,   // read by a compute shader, as a storage image
    VKB_ACCESS_DISPATCH_STORED,   // written by a compute shader
    VKB_ACCESS_COPY_SOURCE,
    VKB_ACCESS_COPY_TARGET,
    VKB_ACCESS_COUNT,
};

VkImageLayout vkb_access_layout(enum vkb_access access);

// Records the barrier that orders two accesses to an image, with the layouts given. Nothing is
// recorded between two equal accesses that only read.
void vkb_barrier_record(const struct vkb_device *device, VkCommandBuffer commands,
                        const VkImageMemoryBarrier *image, enum vkb_access from,
                        enum vkb_access to);

// Makes what copies wrote to host-visible buffers readable for the host after the fence.
void vkb_barrier_record_host_read(const struct vkb_device *device, VkCommandBuffer commands);

// Makes what copies wrote to buffers readable as vertices and indices.
void vkb_barrier_record_upload(const struct vkb_device *device, VkCommandBuffer commands);

// How a render pass uses one of its targets: the access that went before it, its own, and the one
// that comes after it. NONE after: whoever comes next records a barrier.
struct vkb_target_use {
    enum vkb_access before, during, after;
};

enum { VKB_MAX_DEPENDENCIES = 10 };  // two for each of up to five targets

// The subpass dependencies of a render pass with those targets, equal ones merged; returns how
// many.
uint32_t vkb_subpass_dependencies(const struct vkb_target_use *uses, uint32_t use_count,
                                  VkSubpassDependency *dependencies);

#endif
