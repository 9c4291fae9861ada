// One command buffer with its fence and a semaphore, recorded again for each submission.
#ifndef VKB_COMMANDS_H
#define VKB_COMMANDS_H

#include "vulkan/device.h"

struct vkb_commands {
    VkCommandPool pool;
    VkCommandBuffer buffer;
    VkFence fence;
    VkSemaphore available;  // for commands that wait until something else can be written
};

// Destroying a zeroed or half-created object is safe.
bool vkb_commands_create(const struct vkb_device *device, struct vkb_commands *commands,
                         struct vkb_error *error);
void vkb_commands_destroy(const struct vkb_device *device, struct vkb_commands *commands);

// Begins an empty recording. A recording that was not submitted is discarded.
bool vkb_commands_begin(const struct vkb_device *device, struct vkb_commands *commands,
                        struct vkb_error *error);
#endif
