#include "vulkan/commands.h"

bool vkb_commands_create(const struct vkb_device *device, struct vkb_commands *commands,
                         struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;

    *commands = (struct vkb_commands){0};
    bool done =
        VK(error, vk->vkCreateCommandPool(device->handle,
                                          &(VkCommandPoolCreateInfo){
                                              .sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                              .flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT,
                                              .queueFamilyIndex = device->adapter.queue_family,
                                          },
                                          NULL, &commands->pool))
        && VK(error, vk->vkAllocateCommandBuffers(
                         device->handle,
                         &(VkCommandBufferAllocateInfo){
                             .sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                             .commandPool = commands->pool,
                             .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
                             .commandBufferCount = 1,
                         },
                         &commands->buffer))
        && VK(error, vk->vkCreateFence(device->handle,
                                       &(VkFenceCreateInfo){
                                           .sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO,
                                       },
                                       NULL, &commands->fence))
        && VK(error, vk->vkCreateSemaphore(device->handle,
                                           &(VkSemaphoreCreateInfo){
                                               .sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO,
                                           },
                                           NULL, &commands->available));
    if (!done)
        vkb_commands_destroy(device, commands);
    return done;
}

void vkb_commands_destroy(const struct vkb_device *device, struct vkb_commands *commands)
{
    device->vk.vkDestroySemaphore(device->handle, commands->available, NULL);
    device->vk.vkDestroyFence(device->handle, commands->fence, NULL);
    device->vk.vkDestroyCommandPool(device->handle, commands->pool, NULL);
    *commands = (struct vkb_commands){0};
}

bool vkb_commands_begin(const struct vkb_device *device, struct vkb_commands *commands,
                        struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;

    return VK(error, vk->vkResetCommandPool(device->handle, commands->pool, 0))
        && VK(error, vk->vkBeginCommandBuffer(
                         commands->buffer, &(VkCommandBufferBeginInfo){
                                               .sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                               .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT,
                                           }));
}
