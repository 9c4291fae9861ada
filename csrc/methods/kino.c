// Keijiro Takahashi's KinoBloom, version 2, high quality. Source: keijiro/KinoBloom @ 0a04c43fa47d,
// Assets/Kino/Bloom/Bloom.cs.
#include "methods/methods.h"
#include "passes/prefilter.h"

#include <math.h>

// Colours of the frame above this are cut off.
static const float MAX_COLOUR = 65000.0f;

// Sets the sizes of the levels, and returns the step of the tent filter. Both depend on the frame's
// height and the radius, so that the blur covers the same part of small and large frames.
static double choose_sizes(struct vkb_levels *levels)
{
    const double radius = levels->settings->values.radius;
    const double lg = log2(levels->source->buffers.height) + radius - 8.0;
    const uint32_t count = (uint32_t)fmin(fmax(trunc(lg), 1.0), MAX_LEVELS);
    const struct vkb_size size = levels->source->buffers;

    vkb_levels_add_sizes(levels, vkb_halved(size), count);
    return 0.5 + lg - trunc(lg);
}

uint32_t vkb_add_kino_method(struct vkb_levels *levels)
{
    const bool anti_flicker = levels->settings->values.anti_flicker;
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0, 1.0);

    combination.radius_x = combination.radius_y = choose_sizes(levels);
    uint32_t from = vkb_levels_image(levels, levels->source->buffers, "bright");
    struct vkb_pass_row row = vkb_describe_prefilter(
        levels, anti_flicker ? VKB_PREFILTER_kino_median : VKB_PREFILTER_kino, levels->source->glow,
        from);
    row.params.prefilter.clamp_max = MAX_COLOUR;
    vkb_levels_masked(levels, &row);
    for (uint32_t level = 0; level < levels->count; ++level) {
        const uint32_t to = vkb_levels_down(levels, level);
        row = vkb_describe_prefilter(levels, VKB_PREFILTER_kino_level, from, to);
        // The first level's box may weight its taps against fireflies.
        if (anti_flicker && level == 0)
            vkb_levels_pass(levels, &row);
        else
            vkb_levels_box(levels, from, to);
        from = to;
    }
    return vkb_levels_combine(levels, &combination);
}
