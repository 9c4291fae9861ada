// The bloom of Unity's Post Processing Stack v2. Source: Unity-Technologies/PostProcessing
// @ 32c3155207d3, PostProcessing/Runtime/Effects/Bloom.cs, Shaders/Builtins/Bloom.shader.
#include "methods/methods.h"
#include "passes/levels.h"

#include <math.h>

// Reduces by 13 taps half a texel apart, or by four.
static bool reduce(const struct vkb_levels *levels, uint32_t from, uint32_t to,
                   struct vkb_error *error)
{
    return levels->settings->values.fast ? vkb_levels_box(levels, from, to, error)
                                         : vkb_levels_reduce(levels, 0.5, 0.5, from, to, error);
}

static bool add_first(struct vkb_levels *levels, struct vkb_error *error)
{
    uint32_t step;

    if (!vkb_levels_step(levels, "reduced", 0, levels->sizes[0], &step, error)
        || !reduce(levels, levels->source->glow, step, error) || !vkb_levels_down(levels, 0, error))
        return false;
    struct vkb_pass_row row =
        vkb_groups_row(levels, GROUPS_POST_PROCESSING, step, levels->downs[0]);
    vkb_set_tint(&row, levels->settings->tint);
    vkb_mask_prefilter(levels, &row);
    return vkb_graph_add_pass(levels->graph, &row, error);
}

static uint32_t reduced(uint32_t side, double anamorphism)
{
    return (uint32_t)fmax(1.0, floor(side / (2.0 - fmax(anamorphism, 0.0))));
}

bool vkb_add_post_processing(const struct vkb_settings *settings,
                             const struct vkb_bloom_source *source, struct vkb_graph *graph,
                             uint32_t *bloom, struct vkb_error *error)
{
    struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph};
    const struct vkb_values *values = &settings->values;
    struct vkb_size size = {reduced(source->buffers.width, -values->anamorphism),
                            reduced(source->buffers.height, values->anamorphism)};
    const double halvings = log2(fmax(size.width, size.height)) + values->diffusion - 10.0;
    const double count = fmin(fmax(floor(halvings), 1.0), MAX_LEVELS);
    const double radius = 0.5 + halvings - floor(halvings);
    struct vkb_combination combination =
        vkb_combine(values->fast ? UPSAMPLE_CORNERS : UPSAMPLE_TENT, 1.0, 1.0);

    for (; levels.count < (uint32_t)count; size = vkb_halved(size))
        levels.sizes[levels.count++] = size;
    combination.radius_x = combination.radius_y = values->fast ? 0.5 * radius : radius;
    if (!add_first(&levels, error))
        return false;
    for (uint32_t level = 1; level < levels.count; ++level)
        if (!vkb_levels_down(&levels, level, error)
            || !reduce(&levels, levels.downs[level - 1], levels.downs[level], error))
            return false;
    return vkb_levels_combine(&levels, &combination, bloom, error);
}
