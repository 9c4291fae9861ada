#include "vulkan/labels.h"

void vkb_label_object(const struct vkb_device *device, VkObjectType type, uint64_t handle,
                      const char *name)
{
    const struct vkb_instance_table *vk = &device->instance->vk;

    // A failure costs the name alone.
    if (vk->vkSetDebugUtilsObjectNameEXT)
        (void)vk->vkSetDebugUtilsObjectNameEXT(
            device->handle, &(VkDebugUtilsObjectNameInfoEXT){
                                .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT,
                                .objectType = type,
                                .objectHandle = handle,
                                .pObjectName = name,
                            });
}

void vkb_label_begin(const struct vkb_device *device, VkCommandBuffer commands, const char *name)
{
    const struct vkb_instance_table *vk = &device->instance->vk;

    if (vk->vkCmdBeginDebugUtilsLabelEXT)
        vk->vkCmdBeginDebugUtilsLabelEXT(commands,
                                         &(VkDebugUtilsLabelEXT){
                                             .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_LABEL_EXT,
                                             .pLabelName = name,
                                         });
}

void vkb_label_end(const struct vkb_device *device, VkCommandBuffer commands)
{
    if (device->instance->vk.vkCmdEndDebugUtilsLabelEXT)
        device->instance->vk.vkCmdEndDebugUtilsLabelEXT(commands);
}
