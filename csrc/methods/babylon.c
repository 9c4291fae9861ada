// The bloom of Babylon.js' DefaultRenderingPipeline. Source: BabylonJS/Babylon.js, bloomEffect.ts
// @ 05c105649f04, thinBlurPostProcess.ts @ 076e49a15333, kernelBlur.fragment.fx @ 445b0404049f.
#include "methods/methods.h"
#include "passes/levels.h"

bool vkb_add_babylon(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                     struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    struct vkb_levels levels = {.settings = settings, .source = source, .graph = graph, .count = 1};
    // Pairs of taps that are read as one sample are equal to single taps, since the sizes are.
    const struct vkb_kernel kernel = {.weights = settings->weights,
                                      .count = settings->weight_count};
    const double scale = settings->values.scale_x;
    uint32_t bright;

    levels.sizes[0] = (struct vkb_size){vkb_scaled(source->buffers.width, scale),
                                        vkb_scaled(source->buffers.height, scale)};
    if (!vkb_levels_image(&levels, "bright", 0, levels.sizes[0], &bright, error))
        return false;
    struct vkb_pass_row row = vkb_groups_row(&levels, GROUPS_BABYLON, source->glow, bright);
    vkb_mask_prefilter(&levels, &row);
    return vkb_graph_add_pass(graph, &row, error)
        && vkb_levels_blur(&levels, 0, bright, &kernel, error)
        && vkb_levels_enlarge(&levels, UPSAMPLE_LINEAR, levels.downs[0], 1.0, bloom, error);
}
