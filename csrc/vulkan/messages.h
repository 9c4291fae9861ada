// Validation messages, each for the device whose call caused it. All validated devices share one
// instance, and its messenger does not report the device.
#ifndef VKB_MESSAGES_H
#define VKB_MESSAGES_H

#include "vulkan/error.h"

// The messages of a device. An open one must not move in memory.
struct vkb_messages {
    unsigned count;  // since the last vkb_messages_check
    char first[1024];
    struct vkb_messages *next;  // the next open one
};

void vkb_messages_open(struct vkb_messages *messages);
// Closing twice is safe.
void vkb_messages_close(struct vkb_messages *messages);

// Enclose a thread's Vulkan calls for one device. In between, the messages in this thread go to
// `messages`. Returns the previous receiver, for vkb_messages_end, so that sections can be nested.
// A message from a thread outside of any section, such as a thread of the layer, goes to all open
// receivers.
const struct vkb_messages *vkb_messages_begin(const struct vkb_messages *messages);
void vkb_messages_end(const struct vkb_messages *before);

// False if there was a message since the last call; `error` gets the first one.
bool vkb_messages_check(struct vkb_messages *messages, struct vkb_error *error);

// The messenger's callback.
VKAPI_ATTR VkBool32 VKAPI_CALL vkb_messages_receive(
    VkDebugUtilsMessageSeverityFlagBitsEXT severity, VkDebugUtilsMessageTypeFlagsEXT types,
    const VkDebugUtilsMessengerCallbackDataEXT *data, void *unused);

#endif
