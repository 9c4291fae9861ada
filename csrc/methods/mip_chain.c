// This package's own chains of levels: the pyramid, which adds each level while it upsamples, and
// dual Kawase, which does not.
#include "methods/methods.h"
#include "passes/filter.h"

static bool add_down(struct vkb_levels *levels, uint32_t level, struct vkb_error *error)
{
    const struct vkb_values *values = &levels->settings->values;
    const uint32_t from = level ? levels->downs[level - 1] : levels->source->glow;

    if (!vkb_levels_down(levels, level, error))
        return false;
    if (!values->firefly_filter || level > 0)
        return vkb_levels_reduce(levels, values->scale_x, values->scale_y, from,
                                 levels->downs[level], error);
    struct vkb_pass_row row = vkb_groups_row(levels, GROUPS_PYRAMID, from, levels->downs[level]);
    vkb_set_steps(&row, values->scale_x, values->scale_y);
    return vkb_graph_add_pass(levels->graph, &row, error);
}

bool vkb_add_pyramid(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                     struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph};
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0, 1.0);

    vkb_levels_halve(&levels, source->buffers, (uint32_t)settings->values.levels);
    for (uint32_t level = 0; level < levels.count; ++level)
        if (!add_down(&levels, level, error))
            return false;
    combination.radius_x = settings->values.radius * settings->values.scale_x;
    combination.radius_y = settings->values.radius * settings->values.scale_y;
    combination.gain = 1.0 / levels.count;
    if (settings->level_weight_count) {
        for (uint32_t level = 0; level < levels.count; ++level)
            combination.own[level] = settings->level_weights[level];
        combination.smallest = settings->level_weights[levels.count - 1];
        combination.gain = 1.0;
    }
    return vkb_levels_combine(&levels, &combination, bloom, error);
}

bool vkb_add_dual_kawase(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                         struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph};
    const double offset = settings->values.offset;
    uint32_t from = source->glow, to;

    vkb_levels_halve(&levels, source->buffers, (uint32_t)settings->values.levels);
    for (uint32_t level = 0; level < levels.count; ++level, from = to)
        if (!vkb_levels_image(&levels, "down_%u", level, levels.sizes[level], &to, error)
            || !vkb_kawase_down(&levels, offset, from, to, error))
            return false;
    for (uint32_t level = levels.count - 1; level-- > 0; from = to)
        if (!vkb_levels_image(&levels, "up_%u", level, levels.sizes[level], &to, error)
            || !vkb_kawase_up(&levels, offset, from, to, error))
            return false;
    return vkb_levels_image(&levels, "bloom", 0, source->final, bloom, error)
        && vkb_kawase_up(&levels, offset, from, *bloom, error);
}
