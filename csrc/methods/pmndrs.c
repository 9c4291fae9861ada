// The bloom of the library postprocessing for three.js. Source: pmndrs/postprocessing
// @ 69c61a640078 (6.39.0), MipmapBlurPass.js, BloomEffect.js.
#include "methods/methods.h"
#include "passes/filter.h"
#include "passes/prefilter.h"

// The weights of the source are rounded: they add up to 1.00004.
static void add_down(struct vkb_levels *levels, uint32_t level, uint32_t from)
{
    const struct vkb_kernel kernels[][2] = {
        {vkb_sides(1.0, 0.125, 0.0), vkb_sides(1.0, 1.0, 0.0)},
        {vkb_sides(2.0, 0.05556, 0.05556), vkb_sides(2.0, 1.0, 1.0)},
    };
    const uint32_t to = vkb_levels_down(levels, level);
    struct vkb_filter filter = vkb_make_filter(levels->graph, from, to, kernels, 2, 1.0);

    vkb_set_kind(&filter, UPSAMPLE_INSIDE);
    vkb_add_filter_pass(levels, &filter, from, to);
}

uint32_t vkb_add_pmndrs_method(struct vkb_levels *levels)
{
    const struct vkb_values *values = &levels->settings->values;
    const double share = values->radius;
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0 - share, share);
    struct vkb_size size = levels->source->buffers;
    uint32_t from = vkb_levels_image(levels, size, "bright");
    struct vkb_pass_row row =
        vkb_describe_prefilter(levels, VKB_PREFILTER_three_node, levels->source->glow, from);

    vkb_levels_masked(levels, &row);
    levels->count = (uint32_t)values->levels;
    for (uint32_t level = 0; level < levels->count; ++level) {
        size = vkb_halved_up(size);
        levels->sizes[level] = size;
        add_down(levels, level, from);
        from = levels->downs[level];
    }
    // The tent of a single level is mixed with the level itself.
    if (levels->count == 1) {
        levels->sizes[1] = levels->sizes[0];
        levels->downs[1] = levels->downs[0];
        levels->count = 2;
    }
    combination.last_kernel = UPSAMPLE_LINEAR;
    return vkb_levels_combine(levels, &combination);
}
