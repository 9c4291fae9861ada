// Names of objects and labels of commands, for captures and validation messages. Without
// VK_EXT_debug_utils, which only instances with the validation layer or under RenderDoc have, they
// do nothing.
#ifndef VKB_LABELS_H
#define VKB_LABELS_H

#include "vulkan/device.h"

// `handle` is the handle of the object, as a number.
void vkb_label_object(const struct vkb_device *device, VkObjectType type, uint64_t handle,
                      const char *name);

void vkb_label_begin(const struct vkb_device *device, VkCommandBuffer commands, const char *name);
void vkb_label_end(const struct vkb_device *device, VkCommandBuffer commands);

#endif
