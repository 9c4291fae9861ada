#include "passes/threshold.h"

#include <math.h>

enum vkb_mode vkb_threshold_mode(const struct vkb_settings *settings)
{
    if (!settings->thresholded || vkb_method_of(settings)->published)
        return THRESHOLD_NONE;
    return settings->values.knee > 0.0f ? THRESHOLD_KNEE : THRESHOLD_HARD;
}

bool vkb_stages_have_threshold(const struct vkb_settings *settings)
{
    return settings->stage_threshold_count > 0;
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

// The pass without a threshold.
static struct vkb_pass_row describe_pass(const struct vkb_graph *graph, uint32_t image,
                                         uint32_t mask, uint32_t glow)
{
    struct vkb_pass_row row =
        vkb_fullscreen_row(graph->images[glow].name, &vkb_shader_threshold_frag, glow);
    // Not the sampler's filter: it would spread NaN, and a threshold magnifies its rounding errors.
    // The mask is read in the same way, and may have another size than the image.
    const bool same_size = vkb_same_size(graph, image, glow)
                        && (mask == VKB_NO_IMAGE || vkb_same_size(graph, mask, glow));

    row.constants.sampling = same_size ? SAMPLING_TEXEL : SAMPLING_FETCH;
    vkb_read_only(&row, image);
    vkb_apply_mask(&row, mask);
    row.block = VKB_BLOCK_threshold;
    VKB_SET_TARGET(&row, threshold, &graph->images[glow]);
    return row;
}

static void set_threshold(const struct vkb_graph *graph, struct vkb_pass_row *row, float threshold,
                          float knee)
{
    const bool levels = graph->images[row->reads[SLOT_SOURCE]].format == VKB_FORMAT_RGBA8_UNORM;
    const bool hard = knee <= 0.0f;

    row->constants.threshold_mode = hard ? THRESHOLD_HARD : THRESHOLD_KNEE;
    row->params.threshold.threshold = hard && levels ? between_levels(threshold) : threshold;
    row->params.threshold.knee = knee;
}

void vkb_add_threshold_pass(struct vkb_levels *levels, uint32_t image, uint32_t mask, uint32_t glow)
{
    const struct vkb_settings *settings = levels->settings;

    if (levels->failed)
        return;
    if (vkb_method_of(settings)->published)
        mask = VKB_NO_IMAGE;
    struct vkb_pass_row row = describe_pass(levels->graph, image, mask, glow);
    if (vkb_threshold_mode(settings) != THRESHOLD_NONE)
        set_threshold(levels->graph, &row, settings->values.threshold, settings->values.knee);
    vkb_levels_pass(levels, &row);
}

void vkb_add_stage_threshold_pass(struct vkb_levels *levels, uint32_t image, uint32_t mask,
                                  uint32_t glow)
{
    if (levels->failed)
        return;
    struct vkb_pass_row row = describe_pass(levels->graph, image, mask, glow);
    if (vkb_stages_have_threshold(levels->settings))
        set_threshold(levels->graph, &row, levels->settings->stage_threshold[0],
                      levels->settings->stage_threshold[1]);
    vkb_levels_pass(levels, &row);
}

bool vkb_is_threshold(const struct vkb_pass_row *pass)
{
    return vkb_computes(pass, VKB_BLOCK_threshold) && pass->constants.sampling == SAMPLING_TEXEL
        && !pass->constants.masked && !pass->constants.alpha;
}
