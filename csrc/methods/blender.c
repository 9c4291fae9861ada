// The bloom of Blender's Glare node, in high quality: formulas of the compositor of Blender 4.5.
#include "methods/methods.h"
#include "passes/levels.h"

#include <math.h>

// The number of halvings of the glare's share of the shorter side; at least 1.
static uint32_t level_count(const struct vkb_settings *settings, struct vkb_size frame)
{
    const uint32_t shorter = frame.width < frame.height ? frame.width : frame.height;
    const double count = floor(log2(fmax(shorter * settings->values.size, 1.0)));
    return (uint32_t)fmin(fmax(count, 1.0), MAX_LEVELS);
}

bool vkb_add_blender(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                     struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph};
    struct vkb_combination combination = vkb_combine(UPSAMPLE_TENT, 1.0, 1.0);
    struct vkb_size size = source->buffers;

    levels.count = level_count(settings, size);
    for (uint32_t level = 0; level < levels.count; ++level, size = vkb_halved(size)) {
        const uint32_t from = level ? levels.downs[level - 1] : source->glow;
        uint32_t *to = &levels.downs[level];
        levels.sizes[level] = size;
        if (!vkb_levels_image(&levels, "down_%u", level, size, to, error))
            return false;
        struct vkb_pass_row row =
            level == 0   ? vkb_prefilter_row(&levels, &vkb_shader_blender_prefilter_frag, from, *to)
            : level == 1 ? vkb_pyramid_row(&levels, &vkb_shader_blender_down_frag, from, *to)
                         : vkb_down_row(&levels, false, from, *to);
        if (level == 1)
            row.constants.groups = GROUPS_BLENDER;
        if (level == 0)
            vkb_mask_prefilter(&levels, &row);
        if (!vkb_graph_add_pass(graph, &row, error))
            return false;
    }
    combination.last_kernel = UPSAMPLE_LINEAR;
    combination.target_step = true;
    combination.gain = 1.0 / levels.count;
    return vkb_levels_combine(&levels, &combination, bloom, error);
}
