#include "transfer/readback.h"

#include "execute/record.h"
#include "vulkan/parts.h"

#include <string.h>

// Bytes of a row of the image, which may have more channels than the output.
static size_t row_size(const struct vkb_output *output)
{
    return (size_t)output->width * vkb_pixel_size(output->format);
}

bool vkb_readback_is_complete(const struct vkb_output *output)
{
    return output->channels == vkb_formats[output->format].channels;
}

// Bytes of a row in the caller's memory.
static size_t output_row_size(const struct vkb_output *output)
{
    return (size_t)output->width * output->channels * vkb_formats[output->format].channel_size;
}

void vkb_readback_destroy(const struct vkb_device *device, struct vkb_readback *readback)
{
    vkb_readback_release(device, readback);
    vkb_buffer_destroy(device, &readback->staging);
    vkb_buffer_destroy(device, &readback->counts);
    vkb_free(readback->imports);
    *readback = (struct vkb_readback){0};
}

// Imports the complete run of pages at its first use, and keeps the buffer.
static bool import_pages(const struct vkb_device *device, struct vkb_output *output)
{
    struct vkb_page_run *run = output->pages;
    VkDeviceSize start = 0;

    if (!run->buffer.handle
        && !vkb_buffer_import(device, vkb_device_import_usage(device), run->memory, run->size,
                              &run->buffer, &start))
        return false;
    output->imported = run->buffer.handle;
    output->imported_offset = start + (VkDeviceSize)((char *)output->memory - (char *)run->memory);
    return true;
}

static bool import(const struct vkb_device *device, struct vkb_readback *readback, size_t size,
                   struct vkb_output *output)
{
    struct vkb_buffer *buffer = &readback->imports[readback->import_count];

    // A copy writes complete pixels, to addresses that are multiples of their size.
    if (vkb_readback_is_complete(output)
            ? (uintptr_t)output->memory % vkb_pixel_size(output->format) != 0
            : !device->linear_texels || output_row_size(output) % VKB_WORD_SIZE != 0)
        return false;
    if (output->pages)
        return import_pages(device, output);
    if (!vkb_buffer_import(device, vkb_device_import_usage(device), output->memory, size, buffer,
                           &output->imported_offset))
        return false;
    output->imported = buffer->handle;
    ++readback->import_count;
    return true;
}

// Selects how the output, which is rows of an image, is copied.
static bool plan_output(const struct vkb_device *device, struct vkb_readback *readback,
                        const struct vkb_image_row *image, struct vkb_output *output,
                        struct vkb_error *error)
{
    output->format = image->format;
    output->width = image->width;
    output->image = image;
    output->imported = VK_NULL_HANDLE;
    output->sink = VKB_SINK_NONE;
    if (output->exported)
        output->sink = VKB_SINK_EXPORTED;
    if (!output->memory)
        return true;
    if (image->pixels && !image->input && output->channels >= 3) {
        output->sink = VKB_SINK_GIVEN;
        return true;
    }
    const size_t size = row_size(output) * output->row_count;
    const size_t output_size = output_row_size(output) * output->row_count;
    if (output_size >= VKB_IMPORTED_BYTES) {
        if (!vkb_grow(error, &readback->imports, &readback->import_capacity,
                      readback->import_count + 1, sizeof *readback->imports))
            return false;
        // The device copies all channels of an image, so only complete outputs are copied there.
        if (import(device, readback, output_size, output) && vkb_readback_is_complete(output)) {
            output->sink = VKB_SINK_PAGES;
            return true;
        }
    }
    output->sink = VKB_SINK_STAGING;
    output->offset = readback->used;
    // Offsets of image copies must be multiples of the pixel size, which is at most 16.
    readback->used += (size + 15) & ~(size_t)15;
    return true;
}

bool vkb_readback_takes_linear_texels(const struct vkb_device *device,
                                      const struct vkb_output *output)
{
    const VkDeviceSize align = device->limits.minStorageBufferOffsetAlignment;

    // A run of three channels is as long as three quarters of one of four, see store.glsl.
    const size_t run = VKB_STORE_SIZE / 4 * output->channels;

    return output->imported && output->channels >= 3 && output_row_size(output) % run == 0
        && output_row_size(output) % VKB_WORD_SIZE == 0
        && output->imported_offset % VKB_WORD_SIZE == 0 && output->imported_offset % align == 0;
}

static bool prepare(struct vkb_run *run, struct vkb_request *requests, uint32_t request_count,
                    struct vkb_error *error)
{
    struct vkb_readback *readback = &run->submission->readback;

    for (uint32_t i = 0; i < request_count; ++i) {
        const struct vkb_plan *plan = requests[i].plan;
        for (uint32_t output = 0; output < plan->output_count; ++output) {
            if (!plan_output(run->device, readback, &plan->graph.images[plan->outputs[output]],
                             &requests[i].outputs[output], error))
                return false;
        }
    }
    return vkb_buffer_reserve(run->device, VKB_MEMORY_READBACK, VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                              readback->used, &readback->staging, error);
}

void vkb_readback_copy(const struct vkb_device *device, VkCommandBuffer commands,
                       struct vkb_image *image, const struct vkb_output *output, VkBuffer to,
                       VkDeviceSize offset)
{
    VkBufferImageCopy copy = {
        .bufferOffset = offset,
        .imageSubresource = {vkb_formats[image->format].aspect, 0, 0, 1},
        .imageOffset = {0, 0, 0},
        .imageExtent = {image->width, output->row_count, 1},
    };

    vkb_image_transition(device, commands, image, VKB_ACCESS_COPY_SOURCE);
    device->vk.vkCmdCopyImageToBuffer(
        commands, image->handle, vkb_image_layout(image, VKB_ACCESS_COPY_SOURCE), to, 1, &copy);
}

static bool record(struct vkb_run *run, struct vkb_error *error)
{
    const VkCommandBuffer commands = run->submission->commands.buffer;
    const struct vkb_readback *readback = &run->submission->readback;

    (void)error;
    for (uint32_t i = 0; i < run->request->plan->output_count; ++i) {
        struct vkb_cached_image *cached = run->images[run->request->plan->outputs[i]];
        const struct vkb_output *output = &run->request->outputs[i];
        if (output->sink == VKB_SINK_STAGING)
            vkb_readback_copy(run->device, commands, &cached->image, output,
                              readback->staging.handle, output->offset);
        else if (output->sink == VKB_SINK_PAGES)
            vkb_readback_copy(run->device, commands, &cached->image, output, output->imported,
                              output->imported_offset);
        // A pass that stored to the caller's memory did not write the image.
        cached->content.valid = cached->content.valid && output->sink != VKB_SINK_STORED;
    }
    return true;
}

const struct vkb_sink vkb_host_sink = {.prepare = prepare, .record = record};

bool vkb_readback_end(const struct vkb_device *device, const struct vkb_readback *readback,
                      struct vkb_error *error)
{
    return (readback->used == 0 || vkb_buffer_invalidate(device, &readback->staging, error))
        && (!readback->counted || vkb_buffer_invalidate(device, &readback->counts, error));
}

// Copies the first three of four channels of each pixel. It is compiled once for each channel size,
// so that no memcpy has a variable size.
static inline void drop_alpha(unsigned char *to, const unsigned char *from, size_t pixels,
                              size_t size)
{
    // One move for each pixel: the next pixel's red overwrites the alpha.
    for (size_t i = 1; i < pixels; ++i, to += 3 * size, from += 4 * size)
        memcpy(to, from, 4 * size);
    memcpy(to, from, 3 * size);
}

// Copies the first channel of each pixel.
static void take_first(unsigned char *to, const unsigned char *from, size_t pixels, size_t pixel,
                       size_t size)
{
    for (size_t i = 0; i < pixels; ++i)
        memcpy(to + i * size, from + i * pixel, size);
}

static void copy_part(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    const struct vkb_output *output = context;

    (void)part;
    for (; first < end; ++first)
        vkb_copy_given_row(output->image, first, output->channels,
                           (unsigned char *)output->memory + first * output_row_size(output));
}

void vkb_readback_fetch(const struct vkb_device *device, const struct vkb_readback *readback,
                        const struct vkb_output *output)
{
    const size_t pixels = (size_t)output->width * output->row_count;

    if (output->sink == VKB_SINK_GIVEN)
        vkb_in_parts(device->workers, copy_part, NULL, (void *)output, 0, output->row_count,
                     output_row_size(output) * output->row_count);
    if (output->sink != VKB_SINK_STAGING)
        return;
    const unsigned char *from = (const unsigned char *)readback->staging.mapped + output->offset;
    if (vkb_readback_is_complete(output)) {
        memcpy(output->memory, from, row_size(output) * output->row_count);
        return;
    }
    if (output->channels == 1) {
        take_first(output->memory, from, pixels, vkb_pixel_size(output->format),
                   vkb_formats[output->format].channel_size);
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
    while (readback->import_count > 0) {
        --readback->import_count;
        vkb_buffer_destroy(device, &readback->imports[readback->import_count]);
    }
    readback->used = 0;
    readback->counted = false;
}
