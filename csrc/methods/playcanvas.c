// The bloom of PlayCanvas' CameraFrame. Source: playcanvas/engine 2.23, frame-pass-bloom.js and
// downsample.js @ 1f7213d06f78, 2.22.0-beta.20 @ 0aaef5e432c4.
#include "methods/methods.h"
#include "passes/prefilter.h"

#include <math.h>

// Only the format of the buffers limits values from above.
static struct vkb_pass_row describe_row(const struct vkb_levels *levels, uint32_t from, uint32_t to)
{
    struct vkb_pass_row row = vkb_describe_prefilter(levels, VKB_PREFILTER_urp, from, to);

    row.params.prefilter.clamp_max = (float)SINGLE_LIMIT;
    return row;
}

// The half of the frame without negative values, then the first level, to which the threshold is
// applied.
static void add_first(struct vkb_levels *levels)
{
    const struct vkb_size half_size = vkb_halved(levels->source->buffers);
    const uint32_t half = vkb_levels_image(levels, half_size, "half");
    struct vkb_pass_row row = describe_row(levels, levels->source->glow, half);

    row.constants.thresholded = false;
    row.constants.clamped = true;
    vkb_levels_pass(levels, &row);
    const uint32_t step = vkb_levels_step(levels, levels->sizes[0], "reduced");
    vkb_levels_reduce(levels, 1.0, 1.0, half, step);
    row = describe_row(levels, step, vkb_levels_down(levels, 0));
    vkb_levels_masked(levels, &row);
}

uint32_t vkb_add_playcanvas_method(struct vkb_levels *levels)
{
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0, 1.0);
    const struct vkb_size size = vkb_halved(levels->source->buffers);
    const double halvings = floor(log2(fmin(size.width, size.height)));
    const double count = fmin(fmax(halvings, 1.0), levels->settings->values.levels);

    vkb_levels_add_sizes(levels, vkb_halved(size), (uint32_t)count);
    add_first(levels);
    vkb_levels_reduce_rest(levels, 1.0, 1.0);
    combination.last_kernel = UPSAMPLE_LINEAR;
    return vkb_levels_combine(levels, &combination);
}
