// The bloom of Unity's Post Processing Stack v2. Source: Unity-Technologies/PostProcessing
// @ 32c3155207d3, PostProcessing/Runtime/Effects/Bloom.cs, Shaders/Builtins/Bloom.shader.
#include "methods/methods.h"
#include "passes/prefilter.h"

#include <math.h>

// Reduces by 13 taps half a texel apart, or by four.
static void reduce(struct vkb_levels *levels, uint32_t from, uint32_t to)
{
    if (levels->settings->values.fast)
        vkb_levels_box(levels, from, to);
    else
        vkb_levels_reduce(levels, 0.5, 0.5, from, to);
}

static void add_first(struct vkb_levels *levels)
{
    const uint32_t step = vkb_levels_step(levels, levels->sizes[0], "reduced");

    reduce(levels, levels->source->glow, step);
    struct vkb_pass_row row = vkb_describe_prefilter(levels, VKB_PREFILTER_post_processing, step,
                                                     vkb_levels_down(levels, 0));
    vkb_set_tint(&row, levels->settings->tint);
    vkb_levels_masked(levels, &row);
}

static uint32_t reduced(uint32_t side, double anamorphism)
{
    return (uint32_t)fmax(1.0, floor(side / (2.0 - fmax(anamorphism, 0.0))));
}

uint32_t vkb_add_post_processing_method(struct vkb_levels *levels)
{
    const struct vkb_values *values = &levels->settings->values;
    const struct vkb_size frame = levels->source->buffers;
    const struct vkb_size size = {reduced(frame.width, -values->anamorphism),
                                  reduced(frame.height, values->anamorphism)};
    const double halvings = log2(fmax(size.width, size.height)) + values->diffusion - 10.0;
    const double count = fmin(fmax(floor(halvings), 1.0), MAX_LEVELS);
    const double radius = 0.5 + halvings - floor(halvings);
    struct vkb_combination combination =
        vkb_combine(values->fast ? UPSAMPLE_CORNERS : UPSAMPLE_TENT, 1.0, 1.0);

    vkb_levels_add_sizes(levels, size, (uint32_t)count);
    combination.radius_x = combination.radius_y = values->fast ? 0.5 * radius : radius;
    add_first(levels);
    for (uint32_t level = 1; level < levels->count; ++level)
        reduce(levels, levels->downs[level - 1], vkb_levels_down(levels, level));
    return vkb_levels_combine(levels, &combination);
}
