// The bloom of the library postprocessing for three.js. Source: pmndrs/postprocessing
// @ 69c61a640078 (6.39.0), MipmapBlurPass.js, BloomEffect.js.
#include "methods/methods.h"
#include "passes/filter.h"

// The weights of the source are rounded: they add up to 1.00004.
static bool add_down(struct vkb_levels *levels, uint32_t level, uint32_t from,
                     struct vkb_error *error)
{
    const struct vkb_side_taps corners = {1.0, 1.0, 0.0}, grid = {2.0, 1.0, 1.0};

    if (!vkb_levels_down(levels, level, error))
        return false;
    struct vkb_pass_row row = vkb_filter_row(levels, from, levels->downs[level], 1.0);
    vkb_filter_add(&row, 0, (struct vkb_side_taps){1.0, 0.125, 0.0}, corners);
    vkb_filter_add(&row, 1, (struct vkb_side_taps){2.0, 0.05556, 0.05556}, grid);
    row.constants.upsample = UPSAMPLE_INSIDE;
    return vkb_filter_end(levels, &row, error);
}

bool vkb_add_pmndrs(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                    struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph};
    const double share = settings->values.radius;
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0 - share, share);
    struct vkb_size size = source->buffers;
    uint32_t from;

    if (!vkb_levels_image(&levels, "bright", 0, size, &from, error))
        return false;
    struct vkb_pass_row row = vkb_groups_row(&levels, GROUPS_THREE, source->glow, from);
    row.constants.node = true;
    vkb_mask_prefilter(&levels, &row);
    if (!vkb_graph_add_pass(graph, &row, error))
        return false;
    for (; levels.count < (uint32_t)settings->values.levels; from = levels.downs[levels.count++]) {
        levels.sizes[levels.count] = size = vkb_halved_up(size);
        if (!add_down(&levels, levels.count, from, error))
            return false;
    }
    // The tent of a single level is mixed with the level itself.
    if (levels.count == 1) {
        levels.sizes[1] = levels.sizes[0];
        levels.downs[levels.count++] = levels.downs[0];
    }
    combination.last_kernel = UPSAMPLE_LINEAR;
    return vkb_levels_combine(&levels, &combination, bloom, error);
}
