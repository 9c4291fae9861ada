#include "upload.h"

#include <string.h>

void vkb_upload_destroy(const struct vkb_device *device, struct vkb_upload *upload)
{
    vkb_buffer_destroy(device, &upload->staging);
    *upload = (struct vkb_upload){0};
}

// Copies bytes where they differ; reading what is there is cheaper than sending it twice.
static bool replace(unsigned char *to, const unsigned char *from, size_t size)
{
    if (memcmp(to, from, size) == 0)
        return false;
    memcpy(to, from, size);
    return true;
}

// One row of pixels whose channels lie side by side, or each apart.
static bool pack_row(unsigned char *to, const unsigned char *from, const struct vkb_input *input)
{
    const size_t size = vkb_formats[input->format].channel_size, pixel = 4 * size;
    const bool together = input->channel_stride == (ptrdiff_t)size;
    bool changed = false;

    if (together && input->channels == 4 && input->pixel_stride == (ptrdiff_t)pixel)
        return replace(to, from, input->width * pixel);
    for (uint32_t x = 0; x < input->width; ++x, to += pixel, from += input->pixel_stride) {
        if (together) {
            changed |= replace(to, from, input->channels * size);
            continue;
        }
        for (uint32_t channel = 0; channel < input->channels; ++channel)
            changed |= replace(to + channel * size, from + channel * input->channel_stride, size);
    }
    return changed;
}

// A channel of 1 in each format, as bytes.
static const void *channel_one(enum vkb_format format)
{
    static const uint8_t byte = 255;
    static const uint16_t half = 0x3c00;
    static const float single = 1.0f;

    return format == VKB_FORMAT_RGBA8_UNORM  ? (const void *)&byte
         : format == VKB_FORMAT_RGBA16_FLOAT ? (const void *)&half
                                             : (const void *)&single;
}

// A new image of three channels: its alpha is written once, the packing leaves it alone.
static void fill_alpha(struct vkb_upload *upload)
{
    const size_t size = vkb_formats[upload->format].channel_size;
    const void *one = channel_one(upload->format);
    unsigned char *alpha = (unsigned char *)upload->staging.mapped + 3 * size;

    for (size_t i = 0, count = (size_t)upload->width * upload->height; i < count; ++i)
        memcpy(alpha + i * 4 * size, one, size);
}

static void count_special(struct vkb_upload *upload)
{
    const size_t count = (size_t)upload->width * upload->height * 4;
    uint64_t special = 0, infinite = 0;

    if (upload->format == VKB_FORMAT_RGBA16_FLOAT) {
        const uint16_t *bits = upload->staging.mapped;
        for (size_t i = 0; i < count; ++i) {
            special += (bits[i] & 0x7c00) == 0x7c00;
            infinite += (bits[i] & 0x7fff) == 0x7c00;
        }
    } else if (upload->format == VKB_FORMAT_RGBA32_FLOAT) {
        const uint32_t *bits = upload->staging.mapped;
        for (size_t i = 0; i < count; ++i) {
            special += (bits[i] & 0x7f800000) == 0x7f800000;
            infinite += (bits[i] & 0x7fffffff) == 0x7f800000;
        }
    }
    upload->inf_count = infinite;
    upload->nan_count = special - infinite;
}

// Staging memory for an image of that kind; *fresh: it holds no such image yet.
static bool prepare(const struct vkb_device *device, struct vkb_upload *upload,
                    const struct vkb_input *input, bool *fresh, struct vkb_error *error)
{
    const VkDeviceSize size =
        (VkDeviceSize)input->width * input->height * vkb_pixel_size(input->format);

    *fresh = upload->format != input->format || upload->width != input->width
          || upload->height != input->height || upload->channels != input->channels;
    if (!*fresh)
        return true;
    // Cached memory: it is compared with the next image.
    upload->format = VKB_FORMAT_NONE;
    if (!vkb_buffer_reserve(device, VKB_MEMORY_READBACK, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, size,
                            &upload->staging, error))
        return false;
    upload->format = input->format;
    upload->width = input->width;
    upload->height = input->height;
    upload->channels = input->channels;
    if (input->channels == 3)
        fill_alpha(upload);
    return true;
}

bool vkb_upload_stage(const struct vkb_device *device, struct vkb_upload *upload,
                      const struct vkb_input *input, bool *changed, struct vkb_error *error)
{
    const size_t row_size = (size_t)input->width * vkb_pixel_size(input->format);

    if (!prepare(device, upload, input, changed, error))
        return false;
    for (uint32_t y = 0; y < input->height; ++y)
        *changed |= pack_row((unsigned char *)upload->staging.mapped + y * row_size,
                             (const unsigned char *)input->memory + y * input->row_stride, input);
    if (!*changed)
        return true;
    count_special(upload);
    return vkb_buffer_flush(device, &upload->staging, error);
}

void vkb_upload_record(const struct vkb_device *device, VkCommandBuffer commands,
                       const struct vkb_upload *upload, struct vkb_image *image)
{
    VkBufferImageCopy copy = {
        .imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1},
        .imageExtent = {image->width, image->height, 1},
    };

    vkb_image_transition(device, commands, image, VKB_ACCESS_COPY_TARGET);
    device->vk.vkCmdCopyBufferToImage(commands, upload->staging.handle, image->handle,
                                      vkb_access_layout(VKB_ACCESS_COPY_TARGET), 1, &copy);
}
