// darktable's bloom: bright lightness, eight times the mean of a box. Source: darktable 4.2.1,
// src/iop/bloom.c.
#include "methods/methods.h"
#include "passes/levels.h"

#include <math.h>

enum { BOXES = 8, MAX_RADIUS = 256 };

static bool add_box(const struct vkb_levels *levels, uint32_t number, uint32_t *image,
                    struct vkb_error *error)
{
    const struct vkb_size size = levels->sizes[0];
    const bool across = number % 2 == 0;
    const uint32_t from = *image, lines = across ? size.height : size.width;

    if (!vkb_levels_step(levels, "box_%u", number, size, image, error))
        return false;
    struct vkb_pass_row row =
        vkb_row_of_lines(levels, &vkb_shader_box_mean_comp, lines, from, *image);
    row.block = VKB_BLOCK_box;
    row.params.box = (struct vkb_box_params){
        .across = across,
        .radius = (int)floor(MAX_RADIUS * levels->settings->values.size + 0.5),
        .limit = vkb_formats[levels->source->format].limit,
    };
    return vkb_graph_add_pass(levels->graph, &row, error);
}

bool vkb_add_darktable(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                       struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    struct vkb_bloom_source floats = *source;
    struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph, .count = 1};
    uint32_t image;

    levels.sizes[0] = source->buffers;
    if (!vkb_levels_image(&levels, "bright", 0, source->buffers, &image, error))
        return false;
    struct vkb_pass_row row = vkb_groups_row(&levels, GROUPS_DARKTABLE, source->glow, image);
    vkb_mask_prefilter(&levels, &row);
    if (!vkb_graph_add_pass(graph, &row, error))
        return false;
    // Sixteen roundings would be seen.
    floats.format = VKB_FORMAT_RGBA32_FLOAT;
    levels.source = &floats;
    for (uint32_t i = 0; i < 2 * BOXES; ++i)
        if (!add_box(&levels, i, &image, error))
            return false;
    levels.source = source;
    return vkb_levels_enlarge(&levels, UPSAMPLE_LINEAR, image, 1.0, bloom, error);
}
