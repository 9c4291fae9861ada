// The textures and buffers that methods bring along, on the device: each is created and filled once
// for its serial. Passes may change storage images and buffers; these keep their content until they
// are destroyed.
#ifndef VKB_RESOURCES_H
#define VKB_RESOURCES_H

#include "execute/age.h"
#include "graph/graph.h"
#include "vulkan/memory.h"

struct vkb_resource_entry {
    uint64_t serial, used;  // `used`: the last submission that used it
    struct vkb_buffer buffer, staging;
    struct vkb_image image;
    VkSampler sampler;
};

struct vkb_resources {
    struct vkb_resource_entry **entries;  // pointers, since the elements must not move
    size_t count, capacity;
};

void vkb_resources_destroy(const struct vkb_device *device, struct vkb_resources *resources);

// Begins a submission: destroys old entries, if there are many.
enum { VKB_KEPT_RESOURCES = 32 };
void vkb_resources_trim(const struct vkb_device *device, struct vkb_resources *resources,
                        const struct vkb_age *age);

// Creates the resources of a pass that the device does not have, and records that they are filled.
bool vkb_resources_load(const struct vkb_device *device, VkCommandBuffer commands, uint64_t now,
                        const struct vkb_pass_row *pass, struct vkb_resources *resources,
                        struct vkb_error *error);

// The entry of a resource; NULL: it is not loaded.
struct vkb_resource_entry *vkb_resources_find(const struct vkb_resources *resources,
                                              uint64_t serial);

#endif
