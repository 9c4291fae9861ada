// The bloom of PlayCanvas' CameraFrame. Source: playcanvas/engine 2.23, frame-pass-bloom.js and
// downsample.js @ 1f7213d06f78, 2.22.0-beta.20 @ 0aaef5e432c4.
#include "methods/methods.h"
#include "passes/levels.h"

#include <math.h>

// The half of the frame without negative values, then the first level, to which the threshold is
// applied.
static bool add_first(struct vkb_levels *levels, struct vkb_error *error)
{
    const struct vkb_size half_size = vkb_halved(levels->source->buffers);
    uint32_t half, step;

    if (!vkb_levels_image(levels, "half", 0, half_size, &half, error))
        return false;
    struct vkb_pass_row row = vkb_groups_row(levels, GROUPS_URP, levels->source->glow, half);
    row.constants.thresholded = false;
    if (!vkb_graph_add_pass(levels->graph, &row, error)
        || !vkb_levels_step(levels, "reduced", 0, levels->sizes[0], &step, error)
        || !vkb_levels_reduce(levels, 1.0, 1.0, half, step, error)
        || !vkb_levels_down(levels, 0, error))
        return false;
    row = vkb_groups_row(levels, GROUPS_URP, step, levels->downs[0]);
    vkb_mask_prefilter(levels, &row);
    return vkb_graph_add_pass(levels->graph, &row, error);
}

bool vkb_add_playcanvas(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                        struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph};
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0, 1.0);
    struct vkb_size size = vkb_halved(source->buffers);
    const double halvings = floor(log2(fmin(size.width, size.height)));
    const double count = fmin(fmax(halvings, 1.0), settings->values.levels);

    for (size = vkb_halved(size); levels.count < (uint32_t)count; size = vkb_halved(size))
        levels.sizes[levels.count++] = size;
    if (!add_first(&levels, error))
        return false;
    for (uint32_t level = 1; level < levels.count; ++level)
        if (!vkb_levels_down(&levels, level, error)
            || !vkb_levels_reduce(&levels, 1.0, 1.0, levels.downs[level - 1], levels.downs[level],
                                  error))
            return false;
    combination.last_kernel = UPSAMPLE_LINEAR;
    return vkb_levels_combine(&levels, &combination, bloom, error);
}
