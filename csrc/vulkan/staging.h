// Data on its way from the host to the device, through one mapped buffer.
#ifndef VKB_STAGING_H
#define VKB_STAGING_H

#include "vulkan/memory.h"

enum { VKB_MAX_MIP_LEVELS = 16 };

// Mip levels of a picture, or of a cube's six, tightly packed in memory that the caller keeps
// alive; no levels: no such picture.
struct vkb_picture_data {
    enum vkb_format format;
    uint32_t width, height, layers, level_count;
    const void *levels[VKB_MAX_MIP_LEVELS];
};

struct vkb_staging {
    struct vkb_buffer buffer;
    VkDeviceSize used;
};

// The bytes that a piece takes in the buffer.
VkDeviceSize vkb_staging_size(size_t size);
VkDeviceSize vkb_staging_picture_size(const struct vkb_picture_data *data);

// Room for a piece in the buffer, which is large enough; *offset is where it lies.
void *vkb_stage(struct vkb_staging *staging, size_t size, VkDeviceSize *offset);

// A buffer on the device with the piece that lies at `offset`.
bool vkb_staging_load_buffer(const struct vkb_device *device, VkCommandBuffer commands,
                             const struct vkb_staging *staging, VkDeviceSize offset, size_t size,
                             VkBufferUsageFlags usage, struct vkb_buffer *buffer,
                             struct vkb_error *error);

// An image on the device, to be sampled; `name` is what messages call it.
bool vkb_staging_load_picture(const struct vkb_device *device, VkCommandBuffer commands,
                              struct vkb_staging *staging, const char *name,
                              const struct vkb_picture_data *data, struct vkb_image *image,
                              struct vkb_error *error);

#endif
