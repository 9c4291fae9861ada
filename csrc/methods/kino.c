// Keijiro Takahashi's KinoBloom, version 2, high quality. Source: keijiro/KinoBloom @ 0a04c43fa47d,
// Assets/Kino/Bloom/Bloom.cs.
#include "methods/methods.h"
#include "passes/levels.h"

#include <math.h>

// Sets the sizes of the levels, and returns the step of the tent filter. Both depend on the frame's
// height and the radius, so that the blur covers the same part of small and large frames.
static double choose_sizes(struct vkb_levels *levels)
{
    const double radius = levels->settings->values.radius;
    const double lg = log2(levels->source->buffers.height) + radius - 8.0;
    const uint32_t count = (uint32_t)fmin(fmax(trunc(lg), 1.0), MAX_LEVELS);
    struct vkb_size size = levels->source->buffers;

    while (levels->count < count)
        levels->sizes[levels->count++] = size = vkb_halved(size);
    return 0.5 + lg - trunc(lg);
}

// The first level's box may weight its taps against fireflies.
static bool add_box(const struct vkb_levels *levels, bool firefly_filter, uint32_t from,
                    uint32_t to, struct vkb_error *error)
{
    const struct vkb_pass_row row = vkb_groups_row(levels, GROUPS_BOX, from, to);

    return firefly_filter ? vkb_graph_add_pass(levels->graph, &row, error)
                          : vkb_levels_box(levels, from, to, error);
}

bool vkb_add_kino(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                  struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph};
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0, 1.0);
    uint32_t from;

    combination.radius_x = combination.radius_y = choose_sizes(&levels);
    if (!vkb_levels_image(&levels, "bright", 0, source->buffers, &from, error))
        return false;
    struct vkb_pass_row prefilter = vkb_groups_row(&levels, GROUPS_KINO, source->glow, from);
    prefilter.constants.anti_flicker = settings->values.anti_flicker;
    vkb_mask_prefilter(&levels, &prefilter);
    if (!vkb_graph_add_pass(graph, &prefilter, error))
        return false;
    for (uint32_t level = 0; level < levels.count; from = levels.downs[level++]) {
        if (!vkb_levels_down(&levels, level, error))
            return false;
        if (!add_box(&levels, settings->values.anti_flicker && level == 0, from,
                     levels.downs[level], error))
            return false;
    }
    return vkb_levels_combine(&levels, &combination, bloom, error);
}
