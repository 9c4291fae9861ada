#include "execute/descriptors.h"

#include "graph/graph.h"

static uint32_t sets_of(uint32_t pool)
{
    return (uint32_t)VKB_MIN_SETS << pool;
}

void vkb_descriptors_destroy(const struct vkb_device *device, struct vkb_descriptors *descriptors)
{
    for (uint32_t i = 0; i < descriptors->pool_count; ++i)
        device->vk.vkDestroyDescriptorPool(device->handle, descriptors->pools[i], NULL);
    *descriptors = (struct vkb_descriptors){0};
}

bool vkb_descriptors_reset(const struct vkb_device *device, struct vkb_descriptors *descriptors,
                           struct vkb_error *error)
{
    for (uint32_t i = 0; i < descriptors->pool_count; ++i)
        if (!VK(error, device->vk.vkResetDescriptorPool(device->handle, descriptors->pools[i], 0)))
            return false;
    descriptors->pool = descriptors->used = 0;
    return true;
}

// Has room for the most descriptors that a pass can have, in each set.
static bool add_pool(const struct vkb_device *device, struct vkb_descriptors *descriptors,
                     struct vkb_error *error)
{
    const uint32_t sets = sets_of(descriptors->pool_count), resources = sets * VKB_MAX_RESOURCES;

    if (descriptors->pool_count == VKB_MAX_POOLS)
        return vkb_fail(error, VKB_ERROR_GENERAL, "descriptors: a submission needs too many sets");
    if (!VK(error,
            device->vk.vkCreateDescriptorPool(
                device->handle,
                &(VkDescriptorPoolCreateInfo){
                    .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
                    .maxSets = sets,
                    .poolSizeCount = 5,
                    .pPoolSizes =
                        (VkDescriptorPoolSize[]){
                            {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, sets + resources},
                            {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
                             sets * VKB_MAX_READS + resources},
                            {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE,
                             sets * (VKB_MAX_LOADS + VKB_MAX_TARGETS) + resources},
                            {VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, sets * VKB_MAX_LINEAR_TEXELS},
                            // Of a strided copy three.
                            {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 3 * sets + resources},
                        },
                },
                NULL, &descriptors->pools[descriptors->pool_count])))
        return false;
    ++descriptors->pool_count;
    return true;
}

bool vkb_descriptors_allocate(const struct vkb_device *device, struct vkb_descriptors *descriptors,
                              VkDescriptorSetLayout layout, VkDescriptorSet *set,
                              struct vkb_error *error)
{
    if (descriptors->used == sets_of(descriptors->pool)) {
        ++descriptors->pool;
        descriptors->used = 0;
    }
    if (descriptors->pool == descriptors->pool_count && !add_pool(device, descriptors, error))
        return false;
    ++descriptors->used;
    return VK(error, device->vk.vkAllocateDescriptorSets(
                         device->handle,
                         &(VkDescriptorSetAllocateInfo){
                             .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                             .descriptorPool = descriptors->pools[descriptors->pool],
                             .descriptorSetCount = 1,
                             .pSetLayouts = &layout,
                         },
                         set));
}
