// Godot's glow. Source: godotengine/godot, servers/rendering/renderer_rd/shaders/effects: copy.glsl
// @ 0a5efd02df51, tonemap.glsl @ 001c8c9c24dc.
#include "methods/methods.h"
#include "passes/levels.h"

#include <stdio.h>

// Levels with a weight up to this one are left out.
static const float MIN_WEIGHT = 1e-4f;

static bool add_blur(const struct vkb_levels *levels, enum vkb_mode direction, bool first,
                     uint32_t from, uint32_t to, struct vkb_error *error)
{
    struct vkb_pass_row row = vkb_prefilter_row(levels, &vkb_shader_nine_frag, from, to);

    row.constants.groups = GROUPS_GODOT_BLUR;
    row.constants.direction = direction;
    row.constants.first = first;
    if (first && direction == DIRECTION_VERTICAL)
        vkb_mask_prefilter(levels, &row);
    row.params.prefilter.exposure = first ? levels->settings->values.exposure : 0.0f;
    return vkb_graph_add_pass(levels->graph, &row, error);
}

// Always single floats: the engine stores nothing between the blurs, and the threshold would
// magnify a rounding error.
static bool add_step(const struct vkb_levels *levels, uint32_t level, uint32_t *image,
                     struct vkb_error *error)
{
    char name[VKB_NAME_SIZE];

    snprintf(name, sizeof name, "down_%u_across", level);
    return vkb_add_target(levels->graph, name, VKB_FORMAT_RGBA32_FLOAT, levels->sizes[level], false,
                          image, error);
}

bool vkb_add_godot(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                   struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph};
    const enum vkb_mode kernel = settings->values.bicubic ? UPSAMPLE_CUBIC : UPSAMPLE_LINEAR;
    struct vkb_size size = vkb_halved(source->buffers);
    double shares[GATHERED_LEVELS] = {0};
    uint32_t from = source->glow, step;

    levels.count = 1;
    for (uint32_t level = 0; level < settings->level_weight_count; ++level)
        if (settings->level_weights[level] > MIN_WEIGHT) {
            shares[level] = settings->level_weights[level];
            levels.count = level + 1;
        }
    for (uint32_t level = 0; level < levels.count; from = levels.downs[level++]) {
        levels.sizes[level] = size;
        size = vkb_halved(size);
        if (!add_step(&levels, level, &step, error)
            || !add_blur(&levels, DIRECTION_HORIZONTAL, level == 0, from, step, error)
            || !vkb_levels_down(&levels, level, error)
            || !add_blur(&levels, DIRECTION_VERTICAL, level == 0, step, levels.downs[level], error))
            return false;
    }
    return vkb_levels_bloom(&levels, bloom, error)
        && vkb_levels_gather(&levels, shares, kernel, *bloom, error);
}
