// This package's own chains of levels: the pyramid, which adds each level while it upsamples, and
// dual Kawase, which does not.
#include "methods/methods.h"
#include "passes/levels.h"

static bool add_down(struct vkb_levels *levels, uint32_t level, struct vkb_error *error)
{
    const uint32_t from = level ? levels->downs[level - 1] : levels->source->glow;

    if (!vkb_levels_down(levels, level, error))
        return false;
    const bool firefly_filter = levels->settings->values.firefly_filter && level == 0;
    const struct vkb_pass_row row =
        vkb_scaled_down_row(levels, firefly_filter, from, levels->downs[level]);
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

static bool add_kawase(const struct vkb_levels *levels, const struct vkb_shader *fragment,
                       uint32_t from, uint32_t to, struct vkb_error *error)
{
    struct vkb_pass_row row = vkb_fetching_row(levels, fragment, from, to);

    row.block = VKB_BLOCK_kawase;
    vkb_params_read(row.block, &levels->settings->values, &row.params);
    // The threshold pass has applied it.
    row.params.kawase.threshold = 0.0f;
    row.params.kawase.knee = 0.0f;
    VKB_SET_TARGET(&row, kawase, &levels->graph->images[to]);
    row.reach += row.params.kawase.offset;
    return vkb_graph_add_pass(levels->graph, &row, error);
}

bool vkb_add_dual_kawase(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                         struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph};
    uint32_t from = source->glow, to;

    vkb_levels_halve(&levels, source->buffers, (uint32_t)settings->values.levels);
    for (uint32_t level = 0; level < levels.count; ++level, from = to)
        if (!vkb_levels_image(&levels, "down_%u", level, levels.sizes[level], &to, error)
            || !add_kawase(&levels, &vkb_shader_kawase_down_frag, from, to, error))
            return false;
    for (uint32_t level = levels.count - 1; level-- > 0; from = to)
        if (!vkb_levels_image(&levels, "up_%u", level, levels.sizes[level], &to, error)
            || !add_kawase(&levels, &vkb_shader_kawase_up_frag, from, to, error))
            return false;
    return vkb_levels_image(&levels, "bloom", 0, source->final, bloom, error)
        && add_kawase(&levels, &vkb_shader_kawase_up_frag, from, *bloom, error);
}
