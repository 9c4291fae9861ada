#include "transfer/in_place.h"

#include "transfer/readback.h"

static size_t row_size(const struct vkb_input *input)
{
    return (size_t)input->width * input->channels * vkb_formats[input->format].channel_size;
}

// Whether the rows consist of whole words.
static bool has_words(const struct vkb_device *device, const struct vkb_input *input)
{
    const size_t pitch = (size_t)input->row_stride;

    return vkb_input_is_contiguous(input) && input->row_stride > 0 && pitch >= row_size(input)
        && pitch % VKB_WORD_SIZE == 0 && row_size(input) % VKB_WORD_SIZE == 0
        && pitch / VKB_WORD_SIZE * input->height <= device->limits.maxTexelBufferElements;
}

struct counting {
    const struct vkb_input *input;
    struct vkb_non_finite sums[VKB_MAX_PARTS];
};

static void count_part(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    struct counting *counting = context;
    const struct vkb_input *input = counting->input;

    for (uint32_t y = first; y < end; ++y)
        vkb_add_non_finite(&counting->sums[part],
                           vkb_count_non_finite(input->format, vkb_input_row(input, y),
                                                (size_t)input->width * input->channels));
}

bool vkb_in_place_stage(const struct vkb_device *device, struct vkb_in_place *place,
                        const struct vkb_input *input, uint64_t *clock)
{
    const size_t size = row_size(input) * input->height;
    struct counting counting = {.input = input};
    struct vkb_image image = {
        .format = input->format,
        .width = input->width,
        .height = input->height,
        .channels = input->channels,
        // Passes only read it.
        .mapped = (void *)(uintptr_t)input->memory,
        .row_pitch = (size_t)input->row_stride,
    };

    if (!device->linear_texels || size < VKB_IMPORTED_BYTES || input->memory == place->memory
        || !has_words(device, input) || !vkb_image_borrow(device, row_size(input), &image))
        return false;
    vkb_in_parts(device->workers, count_part, NULL, &counting, 0, input->height, size);
    place->non_finite = (struct vkb_non_finite){0};
    for (int part = 0; part < VKB_MAX_PARTS; ++part)
        vkb_add_non_finite(&place->non_finite, counting.sums[part]);
    place->memory = input->memory;
    place->cached.image = image;
    place->cached.content.version = ++*clock;
    place->cached.content.valid = true;
    return true;
}
