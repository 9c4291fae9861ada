// Validation messages, each for the device whose call caused it. The messenger belongs to the
// instance, which all validated devices share, and tells of no device.
#ifndef VKB_MESSAGES_H
#define VKB_MESSAGES_H

#include "vulkan/error.h"

// A device's messages. It must not move in memory while it is open.
struct vkb_messages {
    unsigned count;  // since the last vkb_messages_check
    char first[1024];
    struct vkb_messages *next;  // open, too
};

void vkb_messages_open(struct vkb_messages *messages);
// May be called on closed ones.
void vkb_messages_close(struct vkb_messages *messages);

// Around a thread's Vulkan calls for one device: what the layer says in this thread in between is
// for `messages`. Returns what the thread's messages were for before, for vkb_messages_end; such
// sections nest. A message from a thread without a section (one of the layer's own) goes to all
// that are open: none is lost.
const struct vkb_messages *vkb_messages_begin(const struct vkb_messages *messages);
void vkb_messages_end(const struct vkb_messages *before);

// False, with the first message since the last call, where there was one.
bool vkb_messages_check(struct vkb_messages *messages, struct vkb_error *error);

// The messenger's callback.
VKAPI_ATTR VkBool32 VKAPI_CALL vkb_messages_receive(
    VkDebugUtilsMessageSeverityFlagBitsEXT severity, VkDebugUtilsMessageTypeFlagsEXT types,
    const VkDebugUtilsMessengerCallbackDataEXT *data, void *unused);

#endif
