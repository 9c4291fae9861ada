// darktable's bloom: bright lightness, eight times the mean of a box. Source: darktable 4.2.1,
// src/iop/bloom.c.
#include "methods/methods.h"
#include "passes/prefilter.h"

#include <math.h>

enum { BOXES = 8, MAX_RADIUS = 256 };

static uint32_t add_box(struct vkb_levels *levels, uint32_t number, uint32_t from)
{
    const struct vkb_size size = levels->sizes[0];
    const bool across = number % 2 == 0;
    const uint32_t lines = across ? size.height : size.width;
    const uint32_t to = vkb_levels_step(levels, size, "box_%u", number);
    struct vkb_pass_row row = vkb_row_of_lines(levels, &vkb_shader_box_mean_comp, lines, from, to);

    row.block = VKB_BLOCK_box;
    row.params.box = (struct vkb_box_params){
        .across = across,
        .radius = (int)floor(MAX_RADIUS * levels->settings->values.size + 0.5),
    };
    vkb_levels_pass(levels, &row);
    return to;
}

uint32_t vkb_add_darktable_method(struct vkb_levels *levels)
{
    const struct vkb_bloom_source *source = levels->source;
    struct vkb_bloom_source floats = *source;
    uint32_t image = vkb_levels_image(levels, source->buffers, "bright");
    struct vkb_pass_row row =
        vkb_describe_prefilter(levels, VKB_PREFILTER_darktable, source->glow, image);

    vkb_levels_masked(levels, &row);
    levels->sizes[levels->count++] = source->buffers;
    // Sixteen roundings would be seen.
    floats.format = VKB_FORMAT_RGBA32_FLOAT;
    levels->source = &floats;
    for (uint32_t i = 0; i < 2 * BOXES; ++i)
        image = add_box(levels, i, image);
    levels->source = source;
    return vkb_levels_enlarge(levels, UPSAMPLE_LINEAR, image, 1.0);
}
