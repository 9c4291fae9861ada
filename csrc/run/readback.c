#include "run/readback.h"

#include <string.h>

enum { COPIED_AT_ONCE = 64 };  // rows of a packed image

// Channels of the image, which may be more than those of the output.
static uint32_t image_channels(const struct vkb_output *output)
{
    return output->packed ? 3 : vkb_formats[output->format].channels;
}

static size_t row_size(const struct vkb_output *output)
{
    return (size_t)output->width * image_channels(output)
         * vkb_formats[output->format].channel_size;
}

void vkb_readback_destroy(const struct vkb_device *device, struct vkb_readback *readback)
{
    vkb_readback_release(device, readback);
    vkb_buffer_destroy(device, &readback->staging);
    vkb_free(readback->imports);
    *readback = (struct vkb_readback){0};
}

// They are a buffer from its first use on.
static bool import_pages(const struct vkb_device *device, struct vkb_output *output)
{
    struct vkb_page_run *run = output->pages;
    VkDeviceSize start = 0;

    if (!run->buffer.handle
        && !vkb_buffer_import(device, vkb_device_import_usage(device), run->memory, run->size,
                              &run->buffer, &start))
        return false;
    output->imported = run->buffer.handle;
    output->offset = start + (VkDeviceSize)((char *)output->memory - (char *)run->memory);
    return true;
}

static bool import(const struct vkb_device *device, struct vkb_readback *readback, size_t size,
                   struct vkb_output *output)
{
    const size_t pixel_size = vkb_pixel_size(output->format);
    struct vkb_buffer *buffer = &readback->imports[readback->import_count];

    // The device writes complete pixels, to multiples of their size.
    if (output->channels != image_channels(output)
        || (!output->packed && (uintptr_t)output->memory % pixel_size != 0))
        return false;
    if (output->pages)
        return import_pages(device, output);
    if (!vkb_buffer_import(device, vkb_device_import_usage(device), output->memory, size, buffer,
                           &output->offset))
        return false;
    output->imported = buffer->handle;
    ++readback->import_count;
    return true;
}

bool vkb_readback_plan(const struct vkb_device *device, struct vkb_readback *readback,
                       const struct vkb_image_row *row, struct vkb_output *output,
                       struct vkb_error *error)
{
    output->format = row->format;
    output->width = row->width;
    output->height = row->height;
    output->packed = row->packed;
    output->imported = VK_NULL_HANDLE;
    output->stored = false;
    const size_t size = row_size(output) * row->height;
    if (size >= VKB_IMPORTED_BYTES) {
        if (!vkb_grow(error, &readback->imports, &readback->import_capacity,
                      readback->import_count + 1, sizeof *readback->imports))
            return false;
        if (import(device, readback, size, output))
            return true;
    }
    output->offset = readback->used;
    // Offsets of image copies must be multiples of the pixel size, 16 at the most.
    readback->used += (size + 15) & ~(size_t)15;
    return true;
}

bool vkb_readback_takes_words(const struct vkb_device *device, const struct vkb_output *output)
{
    const VkDeviceSize align = device->limits.minStorageBufferOffsetAlignment;

    return output->imported && row_size(output) % VKB_WORD_SIZE == 0
        && output->offset % VKB_WORD_SIZE == 0 && output->offset % align == 0;
}

bool vkb_readback_reserve(const struct vkb_device *device, struct vkb_readback *readback,
                          struct vkb_error *error)
{
    return vkb_buffer_reserve(device, VKB_MEMORY_READBACK, VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                              readback->used, &readback->staging, error);
}

static void copy_packed(const struct vkb_device *device, VkCommandBuffer commands,
                        const struct vkb_image *image, const struct vkb_output *output, VkBuffer to)
{
    const size_t size = row_size(output);
    // Rows without a gap between them are one.
    const size_t part = size == image->row_pitch ? size * output->height : size;
    const uint32_t count = part == size ? output->height : 1;
    VkBufferCopy copies[COPIED_AT_ONCE];

    for (uint32_t first = 0; first < count; first += COPIED_AT_ONCE) {
        uint32_t i = 0;
        for (; i < COPIED_AT_ONCE && first + i < count; ++i)
            copies[i] = (VkBufferCopy){
                .srcOffset = (first + i) * image->row_pitch,
                .dstOffset = output->offset + (first + i) * part,
                .size = part,
            };
        device->vk.vkCmdCopyBuffer(commands, image->buffer, to, i, copies);
    }
}

void vkb_readback_record(const struct vkb_device *device, VkCommandBuffer commands,
                         const struct vkb_readback *readback, struct vkb_image *image,
                         const struct vkb_output *output)
{
    const VkBuffer to = output->imported ? output->imported : readback->staging.handle;
    VkBufferImageCopy copy = {
        .bufferOffset = output->offset,
        .imageSubresource = {vkb_formats[image->format].aspect, 0, 0, 1},
        .imageExtent = {image->width, image->height, 1},
    };

    if (output->stored)
        return;
    vkb_image_transition(device, commands, image, VKB_ACCESS_COPY_SOURCE);
    if (output->packed)
        copy_packed(device, commands, image, output, to);
    else
        device->vk.vkCmdCopyImageToBuffer(
            commands, image->handle, vkb_image_layout(image, VKB_ACCESS_COPY_SOURCE), to, 1, &copy);
}

bool vkb_readback_end(const struct vkb_device *device, const struct vkb_readback *readback,
                      struct vkb_error *error)
{
    return readback->used == 0 || vkb_buffer_invalidate(device, &readback->staging, error);
}

// The first three of four channels of each pixel; compiled once for each size of a channel, so that
// no copy has a variable size.
static inline void drop_alpha(unsigned char *to, const unsigned char *from, size_t pixels,
                              size_t size)
{
    // The alpha goes where the next pixel's red comes after it, so that a pixel is one move.
    for (size_t i = 1; i < pixels; ++i, to += 3 * size, from += 4 * size)
        memcpy(to, from, 4 * size);
    memcpy(to, from, 3 * size);
}

void vkb_readback_fetch(const struct vkb_readback *readback, const struct vkb_output *output)
{
    const size_t pixels = (size_t)output->width * output->height;

    if (output->imported)
        return;
    const unsigned char *from = (const unsigned char *)readback->staging.mapped + output->offset;
    if (output->channels == image_channels(output)) {
        memcpy(output->memory, from, row_size(output) * output->height);
        return;
    }
    switch (vkb_formats[output->format].channel_size) {
    case 1:
        drop_alpha(output->memory, from, pixels, 1);
        break;
    case 2:
        drop_alpha(output->memory, from, pixels, 2);
        break;
    default:
        drop_alpha(output->memory, from, pixels, 4);
        break;
    }
}

void vkb_readback_release(const struct vkb_device *device, struct vkb_readback *readback)
{
    while (readback->import_count > 0)
        vkb_buffer_destroy(device, &readback->imports[--readback->import_count]);
    readback->used = 0;
}
