// Bevy's bloom. Source: bevyengine/bevy, tag v0.19.1 (b56fc29d3016),
// crates/bevy_post_process/src/bloom: sizes in mod.rs, factors in upsampling_pipeline.rs.
#include "methods/methods.h"
#include "passes/prefilter.h"

#include <math.h>

// The share of `level` in the next larger level; of level 0 in the frame.
static double blend_factor(const struct vkb_settings *settings, uint32_t level, uint32_t count)
{
    const struct vkb_values *values = &settings->values;
    const double intensity = values->intensity, high_pass = values->high_pass_frequency;
    const double x = level / (count - 1.0);
    double boost = 1.0 - pow(1.0 - x, 1.0 / (1.0 - values->low_frequency_boost_curvature));

    boost *= values->low_frequency_boost;
    if (settings->choices[VKB_CHOICE_composite] == COMPOSITE_MIX)
        boost *= 1.0 - intensity;
    return (intensity + boost) * (1.0 - fmin(fmax((x - high_pass) / high_pass, 0.0), 1.0));
}

static void choose_sizes(struct vkb_levels *levels)
{
    const struct vkb_size frame = levels->source->buffers;
    const int height = levels->settings->values.max_mip_dimension;
    const uint32_t count = (uint32_t)fmax(floor(log2(height)), 2.0) - 1;
    const double width = floor((double)frame.width * height / frame.height + 0.5);
    const double most = vkb_widest_level(levels);
    const struct vkb_size size = {(uint32_t)fmin(fmax(width, 1.0), most), (uint32_t)height};

    vkb_levels_add_sizes(levels, size, count);
}

uint32_t vkb_add_bevy_method(struct vkb_levels *levels)
{
    const struct vkb_settings *settings = levels->settings;
    const bool mixed = settings->choices[VKB_CHOICE_composite] == COMPOSITE_MIX;
    const double x = settings->values.scale_x, y = settings->values.scale_y;
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0, 1.0);

    choose_sizes(levels);
    const uint32_t first = vkb_levels_down(levels, 0);
    struct vkb_pass_row row =
        vkb_describe_prefilter(levels, VKB_PREFILTER_bevy, levels->source->glow, first);
    vkb_set_steps(&row, x, y);
    vkb_levels_masked(levels, &row);
    vkb_levels_reduce_rest(levels, x, y);
    for (uint32_t level = 0; level + 1 < levels->count; ++level) {
        const double factor = blend_factor(settings, level + 1, levels->count);
        combination.same_size[level] = mixed ? 1.0 - factor : 1.0;
        combination.coarse[level] = factor;
    }
    combination.radius_x = x;
    combination.radius_y = y;
    return vkb_levels_combine(levels, &combination);
}
