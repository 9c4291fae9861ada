#include "readback.h"

#include <string.h>

#define READBACK_USAGE VK_BUFFER_USAGE_TRANSFER_DST_BIT

void vkb_readback_destroy(const struct vkb_device *device, struct vkb_readback *readback)
{
    vkb_buffer_destroy(device, &readback->staging);
    readback->used = 0;
}

VkDeviceSize vkb_readback_size(enum vkb_format format, uint32_t width, uint32_t height)
{
    VkDeviceSize size = (VkDeviceSize)width * height * vkb_pixel_size(format);
    // Offsets of image copies must be multiples of the pixel size, 16 at the most.
    return (size + 15) & ~(VkDeviceSize)15;
}

bool vkb_readback_begin(const struct vkb_device *device, struct vkb_readback *readback,
                        VkDeviceSize size, struct vkb_error *error)
{
    readback->used = 0;
    return vkb_buffer_reserve(device, VKB_MEMORY_READBACK, READBACK_USAGE, size, &readback->staging,
                              error);
}

void vkb_readback_record(const struct vkb_device *device, VkCommandBuffer commands,
                         struct vkb_readback *readback, struct vkb_image *image,
                         struct vkb_output *output)
{
    VkBufferImageCopy copy = {
        .bufferOffset = readback->used,
        .imageSubresource = {vkb_formats[image->format].aspect, 0, 0, 1},
        .imageExtent = {image->width, image->height, 1},
    };

    output->offset = readback->used;
    output->format = image->format;
    output->pixels = (size_t)image->width * image->height;
    readback->used += vkb_readback_size(image->format, image->width, image->height);
    vkb_image_transition(device, commands, image, VKB_ACCESS_COPY_SOURCE);
    device->vk.vkCmdCopyImageToBuffer(commands, image->handle,
                                      vkb_access_layout(VKB_ACCESS_COPY_SOURCE),
                                      readback->staging.handle, 1, &copy);
}

bool vkb_readback_end(const struct vkb_device *device, const struct vkb_readback *readback,
                      struct vkb_error *error)
{
    return readback->used == 0 || vkb_buffer_invalidate(device, &readback->staging, error);
}

void vkb_readback_fetch(const struct vkb_readback *readback, const struct vkb_output *output)
{
    const struct vkb_format_info *format = &vkb_formats[output->format];
    const unsigned char *from = (const unsigned char *)readback->staging.mapped + output->offset;
    unsigned char *to = output->memory;
    const size_t from_size = vkb_pixel_size(output->format);
    const size_t to_size = (size_t)output->channels * format->channel_size;

    if (from_size == to_size) {
        memcpy(to, from, output->pixels * from_size);
        return;
    }
    for (size_t i = 0; i < output->pixels; ++i)
        memcpy(to + i * to_size, from + i * from_size, to_size);
}
