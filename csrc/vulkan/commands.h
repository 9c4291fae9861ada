// One command buffer, recorded and run anew each time.
#ifndef VKB_COMMANDS_H
#define VKB_COMMANDS_H

#include "vulkan/device.h"

struct vkb_commands {
    VkCommandPool pool;
    VkCommandBuffer buffer;
    VkFence fence;
};

// Destroying a zeroed or half-built object is fine.
bool vkb_commands_create(const struct vkb_device *device, struct vkb_commands *commands,
                         struct vkb_error *error);
void vkb_commands_destroy(const struct vkb_device *device, struct vkb_commands *commands);

// Begins an empty recording; whatever was recorded and not run is dropped.
bool vkb_commands_begin(const struct vkb_device *device, struct vkb_commands *commands,
                        struct vkb_error *error);
// Ends the recording and hands it to the device, which runs it after all that it was handed before.
bool vkb_commands_submit(struct vkb_device *device, struct vkb_commands *commands,
                         struct vkb_error *error);
// Waits until the device has run what was submitted last, which has so many frames.
bool vkb_commands_wait(struct vkb_device *device, struct vkb_commands *commands, uint32_t frames,
                       struct vkb_error *error);
// Whether the device has run what was submitted last, without a wait.
bool vkb_commands_over(const struct vkb_device *device, const struct vkb_commands *commands);

#endif
