// Buffers whose memory other interfaces of the same GPU can import.
#ifndef VKB_EXPORT_H
#define VKB_EXPORT_H

#include "vulkan/memory.h"

// Creates a buffer in memory of its own. *descriptor is a new descriptor of the memory, which
// belongs to the caller. buffer->size is that of the memory. Needs device->exports.
bool vkb_buffer_export(const struct vkb_device *device, VkDeviceSize size,
                       struct vkb_buffer *buffer, int *descriptor, struct vkb_error *error);

#endif
