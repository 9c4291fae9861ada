#include "vulkan/staging.h"

#include "vulkan/labels.h"

#include <string.h>

// Offsets of image copies must be multiples of the pixel size, which is at most 16.
VkDeviceSize vkb_staging_size(size_t size)
{
    return (size + 15) & ~(VkDeviceSize)15;
}

static uint32_t level_side(uint32_t side, uint32_t level)
{
    return side >> level ? side >> level : 1;
}

static size_t level_bytes(const struct vkb_picture_data *data, uint32_t level)
{
    return (size_t)level_side(data->width, level) * level_side(data->height, level) * data->layers
         * vkb_pixel_size(data->format);
}

VkDeviceSize vkb_staging_picture_size(const struct vkb_picture_data *data)
{
    VkDeviceSize size = 0;

    for (uint32_t level = 0; level < data->level_count; ++level)
        size += vkb_staging_size(level_bytes(data, level));
    return size;
}

void *vkb_stage(struct vkb_staging *staging, size_t size, VkDeviceSize *offset)
{
    *offset = staging->used;
    staging->used += vkb_staging_size(size);
    return (char *)staging->buffer.mapped + *offset;
}

bool vkb_staging_load_buffer(const struct vkb_device *device, VkCommandBuffer commands,
                             const struct vkb_staging *staging, VkDeviceSize offset, size_t size,
                             VkBufferUsageFlags usage, struct vkb_buffer *buffer,
                             struct vkb_error *error)
{
    if (!vkb_buffer_create(device, VKB_MEMORY_DEVICE, usage | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                           size, buffer, error))
        return false;
    device->vk.vkCmdCopyBuffer(commands, staging->buffer.handle, buffer->handle, 1,
                               &(VkBufferCopy){
                                   .srcOffset = offset,
                                   .size = size,
                               });
    return true;
}

bool vkb_staging_load_picture(const struct vkb_device *device, VkCommandBuffer commands,
                              struct vkb_staging *staging, const char *name,
                              const struct vkb_picture_data *data, struct vkb_image *image,
                              struct vkb_error *error)
{
    const uint32_t limit = data->layers == 6 ? device->limits.maxImageDimensionCube
                                             : device->limits.maxImageDimension2D;

    if (data->level_count == 0)
        return true;
    if (data->width > limit || data->height > limit)
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "%s: a side of %u pixels is beyond this adapter's limit of %u", name,
                        data->width > data->height ? data->width : data->height, limit);
    if (!vkb_device_supports(device, data->format,
                             VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT))
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "%s: the adapter %s cannot filter %s; uint8 and float16 it can", name,
                        device->adapter.name, vkb_formats[data->format].dtype);
    if (!vkb_image_create(device,
                          &(struct vkb_image_spec){
                              .format = data->format,
                              .width = data->width,
                              .height = data->height,
                              .layers = data->layers,
                              .levels = data->level_count,
                              .usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT,
                          },
                          image, error))
        return false;
    vkb_label_object(device, VK_OBJECT_TYPE_IMAGE, (uint64_t)image->handle,
                     data->layers == 6 ? "skybox" : "texture");
    vkb_image_transition(device, commands, image, VKB_ACCESS_COPY_TARGET);
    for (uint32_t level = 0; level < data->level_count; ++level) {
        const size_t size = level_bytes(data, level);
        VkBufferImageCopy copy = {
            .imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, level, 0, data->layers},
            .imageExtent = {level_side(data->width, level), level_side(data->height, level), 1},
        };
        memcpy(vkb_stage(staging, size, &copy.bufferOffset), data->levels[level], size);
        device->vk.vkCmdCopyBufferToImage(commands, staging->buffer.handle, image->handle,
                                          vkb_access_layout(VKB_ACCESS_COPY_TARGET), 1, &copy);
    }
    vkb_image_transition(device, commands, image, VKB_ACCESS_SAMPLED);
    return true;
}
