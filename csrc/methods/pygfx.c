// The PhysicalBasedBloomPass of pygfx. Source: pygfx/pygfx, pygfx/renderers/wgpu/engine/bloom.py
// @ f5f8f72c.
#include "methods/methods.h"
#include "passes/prefilter.h"

// The number of levels until the longer side is 1, including level 0.
static uint32_t most_levels(struct vkb_size first)
{
    uint32_t longer = first.width > first.height ? first.width : first.height, count = 0;

    for (; longer > 0; longer /= 2)
        ++count;
    return count;
}

uint32_t vkb_add_pygfx_method(struct vkb_levels *levels)
{
    const struct vkb_values *values = &levels->settings->values;
    const enum vkb_prefilter prefilter =
        values->karis_average ? VKB_PREFILTER_pygfx_karis : VKB_PREFILTER_pygfx;
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0, 1.0);
    const struct vkb_size size = vkb_halved(levels->source->buffers);
    const uint32_t wanted = (uint32_t)values->levels, most = most_levels(size);

    vkb_levels_add_sizes(levels, size, wanted < most ? wanted : most);
    const uint32_t first = vkb_levels_down(levels, 0);
    struct vkb_pass_row row =
        vkb_describe_prefilter(levels, prefilter, levels->source->glow, first);
    row.constants.clamped = true;
    vkb_levels_masked(levels, &row);
    vkb_levels_reduce_rest(levels, 1.0, 1.0);
    combination.last_kernel = UPSAMPLE_LINEAR;
    combination.radius_x = combination.radius_y = values->filter_radius;
    combination.width_step = true;
    return vkb_levels_combine(levels, &combination);
}
