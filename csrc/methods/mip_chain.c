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

// Dual Kawase (Bjorge, "Bandwidth-Efficient Rendering", SIGGRAPH 2015). Down: four times the
// centre, and four diagonal taps at a distance of half a texel times the offset.
static bool add_kawase_down(const struct vkb_levels *levels, uint32_t from, uint32_t to,
                            struct vkb_error *error)
{
    const struct vkb_side_taps centre = {0.0, 0.0, 1.0};
    const struct vkb_side_taps sides = {0.5 * levels->settings->values.offset, 0.5, 0.0};
    struct vkb_pass_row row = vkb_filter_row(levels, from, to, 0.5);

    vkb_filter_add(&row, 0, centre, centre);
    vkb_filter_add(&row, 1, sides, sides);
    return vkb_filter_end(levels, &row, error);
}

// Up: four axial taps at a distance of one texel of the smaller level times the offset, and four
// diagonal ones at half that distance with twice the weight.
static bool add_kawase_up(const struct vkb_levels *levels, uint32_t from, uint32_t to,
                          struct vkb_error *error)
{
    const double distance = levels->settings->values.offset;
    const struct vkb_side_taps centre = {0.0, 0.0, 1.0}, axial = {distance, 1.0, 0.0};
    const struct vkb_side_taps diagonal = {0.5 * distance, 1.0, 0.0};
    const struct vkb_side_taps twice = {0.5 * distance, 2.0, 0.0};
    struct vkb_pass_row row = vkb_filter_row(levels, from, to, 1.0 / 12.0);

    vkb_filter_add(&row, 0, axial, centre);
    vkb_filter_add(&row, 1, centre, axial);
    vkb_filter_add(&row, 2, diagonal, twice);
    return vkb_filter_end(levels, &row, error);
}

bool vkb_add_dual_kawase(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                         struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph};
    uint32_t from = source->glow, to;

    vkb_levels_halve(&levels, source->buffers, (uint32_t)settings->values.levels);
    for (uint32_t level = 0; level < levels.count; ++level, from = to)
        if (!vkb_levels_image(&levels, "down_%u", level, levels.sizes[level], &to, error)
            || !add_kawase_down(&levels, from, to, error))
            return false;
    for (uint32_t level = levels.count - 1; level-- > 0; from = to)
        if (!vkb_levels_image(&levels, "up_%u", level, levels.sizes[level], &to, error)
            || !add_kawase_up(&levels, from, to, error))
            return false;
    return vkb_levels_image(&levels, "bloom", 0, source->final, bloom, error)
        && add_kawase_up(&levels, from, *bloom, error);
}
