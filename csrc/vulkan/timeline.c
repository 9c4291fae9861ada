#include "vulkan/timeline.h"

#include "vulkan/device.h"

bool vkb_timeline_export(const struct vkb_device *device, VkSemaphore *semaphore, int *descriptor,
                         struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;
    const VkExportSemaphoreCreateInfo exported = {
        .sType = VK_STRUCTURE_TYPE_EXPORT_SEMAPHORE_CREATE_INFO,
        .handleTypes = VK_EXTERNAL_SEMAPHORE_HANDLE_TYPE_OPAQUE_FD_BIT,
    };
    const VkSemaphoreTypeCreateInfo timeline = {
        .sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO,
        .pNext = &exported,
        .semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE,
    };

    *semaphore = VK_NULL_HANDLE;
    if (VK(error, vk->vkCreateSemaphore(device->handle,
                                        &(VkSemaphoreCreateInfo){
                                            .sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO,
                                            .pNext = &timeline,
                                        },
                                        NULL, semaphore))
        && VK(error, vk->vkGetSemaphoreFdKHR(
                         device->handle,
                         &(VkSemaphoreGetFdInfoKHR){
                             .sType = VK_STRUCTURE_TYPE_SEMAPHORE_GET_FD_INFO_KHR,
                             .semaphore = *semaphore,
                             .handleType = VK_EXTERNAL_SEMAPHORE_HANDLE_TYPE_OPAQUE_FD_BIT,
                         },
                         descriptor)))
        return true;
    vk->vkDestroySemaphore(device->handle, *semaphore, NULL);
    *semaphore = VK_NULL_HANDLE;
    return false;
}
