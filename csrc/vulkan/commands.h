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
// Ends the recording and submits it. The device runs submissions in order. `order` may be NULL.
bool vkb_commands_submit(struct vkb_device *device, struct vkb_commands *commands,
                         const struct vkb_sync *order, struct vkb_error *error);
// Waits for the last submission, which contains `frames` frames.
bool vkb_commands_wait(struct vkb_device *device, struct vkb_commands *commands, uint32_t frames,
                       struct vkb_error *error);
// Whether the last submission is complete; does not wait.
bool vkb_commands_over(const struct vkb_device *device, const struct vkb_commands *commands);
// Makes the fence of a complete submission ready for the next one, as vkb_commands_wait does.
bool vkb_commands_reset(const struct vkb_device *device, const struct vkb_commands *commands,
                        struct vkb_error *error);

#endif
