#include "passes/threshold.h"

#include <math.h>

enum vkb_mode vkb_own_threshold_mode(const struct vkb_settings *settings)
{
    if (!settings->thresholded)
        return THRESHOLD_NONE;
    return settings->values.knee > 0.0f ? THRESHOLD_KNEE : THRESHOLD_HARD;
}

enum vkb_mode vkb_threshold_mode(const struct vkb_settings *settings)
{
    return vkb_method_of(settings)->published ? THRESHOLD_NONE : vkb_own_threshold_mode(settings);
}

// The luminances of 8-bit colours, (2126 r + 7152 g + 722 b) / 10000 / 255, are integer multiples
// of 1 / 1275000. The threshold is moved to the middle between two of them. Otherwise rounding in
// samplers and shaders lets colours pass whose luminance is equal to the threshold.
static float between_levels(float threshold)
{
    const double steps = 1275000.0;
    // A decimal number up to 1 and its float differ by less than a tenth of a step.
    return (float)((floor(threshold * steps + 0.1) + 0.5) / steps);
}

void vkb_add_threshold(struct vkb_levels *levels, uint32_t image, uint32_t mask, uint32_t glow)
{
    vkb_add_threshold_in(levels, vkb_threshold_mode(levels->settings), image,
                         vkb_method_of(levels->settings)->published ? VKB_NO_IMAGE : mask, glow);
}

void vkb_add_threshold_in(struct vkb_levels *levels, enum vkb_mode mode, uint32_t image,
                          uint32_t mask, uint32_t glow)
{
    const struct vkb_graph *graph = levels->graph;

    if (levels->failed)
        return;
    struct vkb_pass_row row =
        vkb_fullscreen_row(graph->images[glow].name, &vkb_shader_threshold_frag, glow);

    row.constants.threshold_mode = mode;
    // Not the sampler's filter: it would spread NaN, and a threshold magnifies its rounding errors.
    // The mask is read in the same way, and may have another size than the image.
    const bool same_size = vkb_same_size(graph, image, glow)
                        && (mask == VKB_NO_IMAGE || vkb_same_size(graph, mask, glow));
    row.constants.sampling = same_size ? SAMPLING_TEXEL : SAMPLING_FETCH;
    vkb_read_only(&row, image);
    vkb_apply_mask(&row, mask);
    row.block = VKB_BLOCK_threshold;
    // Without a threshold its settings stay 0, so that the pass does not depend on them.
    if (mode != THRESHOLD_NONE)
        vkb_params_read(row.block, &levels->settings->values, &row.params);
    if (mode == THRESHOLD_HARD && graph->images[image].format == VKB_FORMAT_RGBA8_UNORM)
        row.params.threshold.threshold = between_levels(row.params.threshold.threshold);
    VKB_SET_TARGET(&row, threshold, &graph->images[glow]);
    vkb_levels_pass(levels, &row);
}

bool vkb_is_threshold(const struct vkb_pass_row *pass)
{
    return vkb_computes(pass, VKB_BLOCK_threshold) && pass->constants.sampling == SAMPLING_TEXEL
        && !pass->constants.masked && !pass->constants.alpha;
}
