// The textures and buffers that methods bring along, on the device: each is created and filled once
// for its serial. Passes may change storage images and buffers; these are kept as long as there is
// their owner, also after a failure. The others are a cache.
#ifndef VKB_RESOURCES_H
#define VKB_RESOURCES_H

#include "execute/age.h"
#include "graph/graph.h"
#include "vulkan/image.h"

struct vkb_resource_entry {
    uint64_t serial;
    uint64_t filled, used;    // the submissions that filled it, and that used it last
    struct vkb_owner *owner;  // of its state; NULL: it has none
    struct vkb_buffer buffer, staging;
    struct vkb_image image;
    VkSampler sampler;
};

struct vkb_resources {
    struct vkb_resource_entry **entries;  // pointers, since the elements must not move
    size_t count, capacity;
};

void vkb_resources_destroy(const struct vkb_device *device, struct vkb_resources *resources);

// Begins a submission: destroys entries whose owner is gone, old entries without an owner if there
// are many, and the staging memory of those that are filled.
enum { VKB_KEPT_RESOURCES = 32 };
void vkb_resources_trim(const struct vkb_device *device, struct vkb_resources *resources,
                        const struct vkb_age *age);

// Ends a submission that failed before the device got it: destroys the entries that it would have
// filled. Those before keep their content.
void vkb_resources_drop(const struct vkb_device *device, struct vkb_resources *resources,
                        uint64_t submission);

// Creates the resources of a pass that the device does not have, and records that they are filled.
bool vkb_resources_load(const struct vkb_device *device, VkCommandBuffer commands, uint64_t now,
                        const struct vkb_pass_row *pass, struct vkb_resources *resources,
                        struct vkb_error *error);

// The entry of a resource; NULL: it is not loaded.
struct vkb_resource_entry *vkb_resources_find(const struct vkb_resources *resources,
                                              uint64_t serial);

#endif
