// One command buffer, recorded and run anew each time.
#ifndef VKB_COMMANDS_H
#define VKB_COMMANDS_H

#include "device.h"

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
// Ends the recording, runs it, waits for it.
bool vkb_commands_run(struct vkb_device *device, struct vkb_commands *commands,
                      struct vkb_error *error);

#endif
