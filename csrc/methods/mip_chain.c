// This package's own chains of levels: the pyramid, which adds each level while it upsamples, and
// dual Kawase, which does not.
#include "methods/methods.h"
#include "passes/filter.h"
#include "passes/prefilter.h"

uint32_t vkb_add_pyramid_method(struct vkb_levels *levels)
{
    const struct vkb_settings *settings = levels->settings;
    const double x = settings->values.scale_x, y = settings->values.scale_y;
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0, 1.0);
    const uint32_t glow = levels->source->glow;

    vkb_levels_halve(levels, levels->source->buffers, (uint32_t)settings->values.levels);
    const uint32_t first = vkb_levels_down(levels, 0);
    if (settings->values.firefly_filter) {
        struct vkb_pass_row row =
            vkb_describe_prefilter(levels, VKB_PREFILTER_pyramid, glow, first);
        vkb_set_steps(&row, x, y);
        vkb_levels_pass(levels, &row);
    } else {
        vkb_levels_reduce(levels, x, y, glow, first);
    }
    vkb_levels_reduce_rest(levels, x, y);
    combination.radius_x = settings->values.radius * x;
    combination.radius_y = settings->values.radius * y;
    combination.gain = 1.0 / levels->count;
    if (settings->level_weight_count) {
        for (uint32_t level = 0; level < levels->count; ++level)
            combination.same_size[level] = settings->level_weights[level];
        combination.smallest = settings->level_weights[levels->count - 1];
        combination.gain = 1.0;
    }
    return vkb_levels_combine(levels, &combination);
}

uint32_t vkb_add_dual_kawase_method(struct vkb_levels *levels)
{
    const struct vkb_values *values = &levels->settings->values;
    uint32_t from = levels->source->glow;

    vkb_levels_halve(levels, levels->source->buffers, (uint32_t)values->levels);
    for (uint32_t level = 0; level < levels->count; ++level) {
        const uint32_t to = vkb_levels_down(levels, level);
        vkb_kawase_down(levels, values->offset, from, to);
        from = to;
    }
    from = vkb_kawase_rise(levels, values->offset);
    const uint32_t bloom =
        vkb_levels_target(levels, "bloom", levels->source->format, levels->source->final, true);
    vkb_kawase_up(levels, values->offset, from, bloom);
    return bloom;
}
