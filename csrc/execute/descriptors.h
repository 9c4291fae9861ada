// The descriptor sets of a submission. Whoever records a set allocates it here; another pool is
// created when all are full, so that nothing has to know before how many sets there will be.
#ifndef VKB_DESCRIPTORS_H
#define VKB_DESCRIPTORS_H

#include "vulkan/device.h"

enum { VKB_MAX_POOLS = 24 };

// Pools of VKB_MIN_SETS, of twice as many, and so on. Zero-initialized.
enum { VKB_MIN_SETS = 64 };
struct vkb_descriptors {
    VkDescriptorPool pools[VKB_MAX_POOLS];
    uint32_t pool_count;
    uint32_t pool, used;  // that sets are allocated from, and how many it has given
};

void vkb_descriptors_destroy(const struct vkb_device *device, struct vkb_descriptors *descriptors);

// Takes back all sets, which the device must not use any more.
bool vkb_descriptors_reset(const struct vkb_device *device, struct vkb_descriptors *descriptors,
                           struct vkb_error *error);

bool vkb_descriptors_allocate(const struct vkb_device *device, struct vkb_descriptors *descriptors,
                              VkDescriptorSetLayout layout, VkDescriptorSet *set,
                              struct vkb_error *error);

#endif
