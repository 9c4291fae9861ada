// Uploads from the host to the device, through one mapped buffer.
#ifndef VKB_STAGING_H
#define VKB_STAGING_H

#include "vulkan/image.h"

enum { VKB_MAX_MIP_LEVELS = 16 };  // of the longest side

// The mip levels of a picture, or of the six faces of a cube, tightly packed. The caller keeps the
// memory alive. No levels: there is no picture.
struct vkb_picture_data {
    enum vkb_format format;
    uint32_t width, height, layers, level_count;
    const void *levels[VKB_MAX_MIP_LEVELS];
};

struct vkb_staging {
    struct vkb_buffer buffer;
    VkDeviceSize used;
};

// The bytes that a block of data needs in the buffer, with alignment.
VkDeviceSize vkb_staging_size(size_t size);
VkDeviceSize vkb_staging_picture_size(const struct vkb_picture_data *data);

// Reserves space for a block in the buffer, which must be large enough; *offset is its offset.
void *vkb_stage(struct vkb_staging *staging, size_t size, VkDeviceSize *offset);

// Creates a device buffer and records its copy from the block at `offset`.
bool vkb_staging_load_buffer(const struct vkb_device *device, VkCommandBuffer commands,
                             const struct vkb_staging *staging, VkDeviceSize offset, size_t size,
                             VkBufferUsageFlags usage, struct vkb_buffer *buffer,
                             struct vkb_error *error);

// Creates a sampled device image and records its copy. `name` is its name in errors.
bool vkb_staging_load_picture(const struct vkb_device *device, VkCommandBuffer commands,
                              struct vkb_staging *staging, const char *name,
                              const struct vkb_picture_data *data, struct vkb_image *image,
                              struct vkb_error *error);

#endif
