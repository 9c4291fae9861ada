// The graph of an image from the host: it is reduced to the size of the bloom buffers, thresholded
// and blurred, and the result is added to it. If there is an emission, the bloom is made from that
// instead.
#include "methods/methods.h"

#include <stdio.h>

static uint32_t add_input(struct vkb_levels *levels, const struct vkb_image_source *image,
                          enum vkb_input_kind kind)
{
    static const char *const names[VKB_INPUT_COUNT] = {
        [VKB_INPUT_IMAGE] = "image",       [VKB_INPUT_EMISSION] = "emission",
        [VKB_INPUT_MASK] = "mask",         [VKB_INPUT_MOTION_X] = "motion_x",
        [VKB_INPUT_MOTION_Y] = "motion_y", [VKB_INPUT_DEPTH] = "depth",
    };
    const bool grey = vkb_is_grey(kind);
    struct vkb_image_row row = {
        .format = grey ? VKB_FORMAT_R32_FLOAT : image->format,
        .width = image->size.width,
        .height = image->size.height,
        .channels = grey ? 1 : image->channels,
        .input = kind,
    };

    vkb_set_name(row.name, sizeof row.name, names[kind]);
    return vkb_levels_add(levels, &row);
}

static bool check_alpha(const struct vkb_settings *settings, const struct vkb_image_source *image,
                        struct vkb_error *error)
{
    const int alpha = settings->choices[VKB_CHOICE_alpha];
    const char *name = vkb_choice_rows[VKB_CHOICE_alpha].spellings[alpha];

    if (alpha == ALPHA_KEEP)
        return true;
    if (image->channels != 4)
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "alpha: '%s' needs an image of 4 channels, and this one has %u", name,
                        image->channels);
    if (vkb_formats[settings->format].has_no_alpha)
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "alpha: '%s' needs bloom buffers that have an alpha, and %s has none", name,
                        vkb_formats[settings->format].name);
    return true;
}

// `from` is what glows: the image, or its emission.
static uint32_t add_bloom(struct vkb_levels *levels, const struct vkb_image_source *image,
                          uint32_t scene, uint32_t from, uint32_t mask)
{
    const struct vkb_settings *settings = levels->settings;
    struct vkb_graph *graph = levels->graph;
    struct vkb_bloom_source source = {
        .scene = scene,
        .mask = mask,
        .blurs_alpha = settings->choices[VKB_CHOICE_alpha] == ALPHA_BLUR,
        .buffers = vkb_bloom_size(settings, image->size),
        .final = image->size,
        .format = settings->format ? settings->format : image->format,
    };

    source.glow = vkb_add_first_image(levels, vkb_first_format(settings, source.format),
                                      source.buffers, true);
    vkb_add_threshold_pass(levels, from, mask, source.glow);
    const uint32_t bloom = vkb_add_bloom(levels, &source);
    for (uint32_t i = 0; source.blurs_alpha && i < graph->pass_count; ++i)
        graph->passes[i].constants.alpha = ALPHA_BLUR;
    return bloom;
}

static void add_geometry(struct vkb_levels *levels, const struct vkb_image_source *image,
                         struct vkb_taa_inputs *inputs)
{
    if (!levels->settings->taa_engine)
        return;
    if (image->has_motion) {
        inputs->motion_x = add_input(levels, image, VKB_INPUT_MOTION_X);
        inputs->motion_y = add_input(levels, image, VKB_INPUT_MOTION_Y);
    }
    if (image->has_depth)
        inputs->depth = add_input(levels, image, VKB_INPUT_DEPTH);
}

void vkb_build_image(struct vkb_levels *levels, const struct vkb_image_source *image)
{
    const struct vkb_settings *settings = levels->settings;
    struct vkb_composite_source source = {
        .bloom = VKB_NO_IMAGE,
        .mask = VKB_NO_IMAGE,
        .apart = image->has_emission,
        .lit = vkb_has_glare(settings),
        .alpha = (enum vkb_alpha)settings->choices[VKB_CHOICE_alpha],
    };
    struct vkb_time_stages stages = vkb_begin_time_stages(settings);

    levels->failed = !check_alpha(settings, image, levels->error);
    uint32_t glow = source.scene = add_input(levels, image, VKB_INPUT_IMAGE);
    if (image->has_emission)
        glow = add_input(levels, image, VKB_INPUT_EMISSION);
    if (image->has_mask)
        source.mask = add_input(levels, image, VKB_INPUT_MASK);
    add_geometry(levels, image, &stages.taa);
    vkb_add_time_stages_before(levels, &stages, &source.scene, &glow);
    if (settings->values.bloom)
        source.bloom = add_bloom(levels, image, source.scene, glow, source.mask);
    vkb_add_time_stages_after(levels, &stages, &source);
    vkb_add_composite_pass(levels, &source, image->format);
}
