// Godot's glow. Source: godotengine/godot, servers/rendering/renderer_rd/shaders/effects: copy.glsl
// @ 0a5efd02df51, tonemap.glsl @ 001c8c9c24dc.
#include "methods/methods.h"
#include "passes/prefilter.h"

#include <stdio.h>

// Levels with a weight up to this one are left out.
static const float MIN_WEIGHT = 1e-4f;

static const struct vkb_kernel kernel = {.count = 5, .step = 1.0, .weights = {GODOT_NINE}};

static void add_blur(struct vkb_levels *levels, enum vkb_mode direction, bool first, uint32_t from,
                     uint32_t to)
{
    const enum vkb_prefilter prefilter = !first ? VKB_PREFILTER_godot_level
                                       : direction == DIRECTION_HORIZONTAL
                                           ? VKB_PREFILTER_godot_across
                                           : VKB_PREFILTER_godot_down;
    struct vkb_pass_row row = vkb_describe_prefilter(levels, prefilter, from, to);
    struct vkb_filter filter;

    row.constants.direction = direction;
    if (first && direction == DIRECTION_VERTICAL)
        vkb_apply_mask(&row, levels->source->mask);
    // The first blurs are of samples of the frame at the level's pixels, and of what glows.
    vkb_filter_begin(levels->graph, first ? to : from, to, &filter);
    struct vkb_axis *axis = direction == DIRECTION_HORIZONTAL ? &filter.x : &filter.y;
    axis->kernel = kernel;
    axis->border = VKB_BORDER_PAIRS;
    // The horizontal blur leaves the strength to the vertical one.
    if (!first && direction == DIRECTION_VERTICAL)
        filter.gain = row.params.prefilter.strength;
    vkb_set_filters(levels, &row, &filter, 1);
    row.params.prefilter.exposure = first ? levels->settings->values.exposure : 0.0f;
    vkb_levels_pass(levels, &row);
}

// Adds up the levels that have a share; the first one, if none has.
static void add_sum(struct vkb_levels *levels, const double *shares, enum vkb_mode upsample,
                    uint32_t bloom)
{
    struct vkb_levels taken = *levels;
    double taken_shares[GATHERED_LEVELS] = {0};

    taken.count = 0;
    for (uint32_t level = 0; level < levels->count; ++level)
        if (shares[level] > 0.0) {
            taken_shares[taken.count] = shares[level];
            taken.downs[taken.count++] = levels->downs[level];
        }
    taken.count = taken.count ? taken.count : 1;
    vkb_levels_gather(&taken, taken_shares, upsample, bloom);
    levels->failed = taken.failed;
}

uint32_t vkb_add_godot_method(struct vkb_levels *levels)
{
    const struct vkb_settings *settings = levels->settings;
    const enum vkb_mode upsample = settings->values.bicubic ? UPSAMPLE_CUBIC : UPSAMPLE_LINEAR;
    struct vkb_size size = vkb_halved(levels->source->buffers);
    double shares[GATHERED_LEVELS] = {0};
    uint32_t from = levels->source->glow;

    levels->count = 1;
    for (uint32_t level = 0; level < settings->level_weight_count; ++level)
        if (settings->level_weights[level] > MIN_WEIGHT) {
            shares[level] = settings->level_weights[level];
            levels->count = level + 1;
        }
    for (uint32_t level = 0; level < levels->count; ++level) {
        char name[VKB_NAME_SIZE];
        snprintf(name, sizeof name, "down_%u_across", level);
        levels->sizes[level] = size;
        // Always single floats: the engine stores nothing between the blurs, and the threshold
        // would magnify a rounding error.
        const uint32_t step = vkb_levels_target(levels, name, VKB_FORMAT_RGBA32_FLOAT, size, false);
        add_blur(levels, DIRECTION_HORIZONTAL, level == 0, from, step);
        add_blur(levels, DIRECTION_VERTICAL, level == 0, step, vkb_levels_down(levels, level));
        from = levels->downs[level];
        size = vkb_halved(size);
    }
    const uint32_t bloom = vkb_levels_bloom(levels);
    add_sum(levels, shares, upsample, bloom);
    return bloom;
}
