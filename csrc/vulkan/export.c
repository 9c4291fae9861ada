#include "vulkan/export.h"

static bool create_buffer(const struct vkb_device *device, VkDeviceSize size, VkBuffer *buffer,
                          struct vkb_error *error)
{
    return VK(error, device->vk.vkCreateBuffer(
                         device->handle,
                         &(VkBufferCreateInfo){
                             .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
                             .pNext =
                                 &(VkExternalMemoryBufferCreateInfo){
                                     .sType = VK_STRUCTURE_TYPE_EXTERNAL_MEMORY_BUFFER_CREATE_INFO,
                                     .handleTypes = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT,
                                 },
                             .size = size,
                             .usage = vkb_device_export_usage(),
                         },
                         NULL, buffer));
}

bool vkb_buffer_export(const struct vkb_device *device, VkDeviceSize size,
                       struct vkb_buffer *buffer, int *descriptor, struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;
    VkMemoryRequirements requirements;
    VkMemoryPropertyFlags flags;

    *buffer = (struct vkb_buffer){0};
    if (!create_buffer(device, size, &buffer->handle, error))
        return false;
    vk->vkGetBufferMemoryRequirements(device->handle, buffer->handle, &requirements);
    const VkMemoryDedicatedAllocateInfo dedicated = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_DEDICATED_ALLOCATE_INFO,
        .buffer = buffer->handle,
    };
    const VkExportMemoryAllocateInfo exported = {
        .sType = VK_STRUCTURE_TYPE_EXPORT_MEMORY_ALLOCATE_INFO,
        .pNext = &dedicated,
        .handleTypes = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT,
    };
    if (vkb_memory_allocate(device, VKB_MEMORY_DEVICE, &requirements, &exported, &buffer->memory,
                            &flags, error)
        && VK(error, vk->vkBindBufferMemory(device->handle, buffer->handle, buffer->memory, 0))
        && VK(error,
              vk->vkGetMemoryFdKHR(device->handle,
                                   &(VkMemoryGetFdInfoKHR){
                                       .sType = VK_STRUCTURE_TYPE_MEMORY_GET_FD_INFO_KHR,
                                       .memory = buffer->memory,
                                       .handleType = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT,
                                   },
                                   descriptor))) {
        buffer->size = requirements.size;
        return true;
    }
    vkb_buffer_destroy(device, buffer);
    return false;
}
