// The PhysicalBasedBloomPass of pygfx. Source: pygfx/pygfx, pygfx/renderers/wgpu/engine/bloom.py
// @ f5f8f72c.
#include "methods/methods.h"
#include "passes/levels.h"

// The number of levels until the longer side is 1, including level 0.
static uint32_t most_levels(struct vkb_size first)
{
    uint32_t longer = first.width > first.height ? first.width : first.height, count = 0;

    for (; longer > 0; longer /= 2)
        ++count;
    return count;
}

bool vkb_add_pygfx(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                   struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph};
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0, 1.0);
    struct vkb_size size = vkb_halved(source->buffers);
    const uint32_t wanted = (uint32_t)settings->values.levels, most = most_levels(size);
    uint32_t from = source->glow;

    levels.count = wanted < most ? wanted : most;
    for (uint32_t level = 0; level < levels.count; from = levels.downs[level++]) {
        levels.sizes[level] = size;
        if (!vkb_levels_down(&levels, level, error))
            return false;
        size = vkb_halved(size);
        if (level > 0) {
            if (!vkb_levels_reduce(&levels, 1.0, 1.0, from, levels.downs[level], error))
                return false;
            continue;
        }
        struct vkb_pass_row row = vkb_groups_row(
            &levels, settings->values.karis_average ? GROUPS_PYGFX_KARIS : GROUPS_PYGFX, from,
            levels.downs[0]);
        vkb_mask_prefilter(&levels, &row);
        if (!vkb_graph_add_pass(graph, &row, error))
            return false;
    }
    combination.last_kernel = UPSAMPLE_LINEAR;
    combination.radius_x = combination.radius_y = settings->values.filter_radius;
    combination.width_step = true;
    return vkb_levels_combine(&levels, &combination, bloom, error);
}
