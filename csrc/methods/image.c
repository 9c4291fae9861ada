// The graph of an image from the host: it is reduced to the size of the bloom buffers, thresholded
// and blurred, and the result is added to it. If there is an emission, the bloom is made from that
// instead.
#include "methods/methods.h"

#include <stdio.h>

static uint32_t add_input(struct vkb_levels *levels, const struct vkb_image_source *image,
                          enum vkb_input_kind kind)
{
    static const char *const names[VKB_INPUT_COUNT] = {
        [VKB_INPUT_IMAGE] = "image",
        [VKB_INPUT_EMISSION] = "emission",
        [VKB_INPUT_MASK] = "mask",
    };
    struct vkb_image_row row = {
        .format = kind == VKB_INPUT_MASK ? VKB_FORMAT_R32_FLOAT : image->format,
        .width = image->size.width,
        .height = image->size.height,
        .channels = kind == VKB_INPUT_MASK ? 1 : image->channels,
        .input = kind,
    };

    snprintf(row.name, sizeof row.name, "%s", names[kind]);
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

struct vkb_exposed vkb_begin_exposure(const struct vkb_settings *settings)
{
    return (struct vkb_exposed){
        .image = VKB_NO_IMAGE,
        .before = vkb_exposure_has(settings, EXPOSES_BLOOM),
        .after = vkb_exposure_has(settings, EXPOSES_PICTURE),
        .meters_bloom = vkb_exposure_has(settings, METERS_BLOOM),
    };
}

void vkb_expose_inputs(struct vkb_levels *levels, struct vkb_exposed *exposure, uint32_t *scene,
                       uint32_t *glow)
{
    const bool one = *scene == *glow;

    if (levels->settings->exposure_engine && !exposure->meters_bloom)
        exposure->image = vkb_add_exposure(levels, *scene);
    if (!exposure->before)
        return;
    *scene = vkb_add_exposed(levels, "exposed", true, *scene, exposure->image, false);
    *glow = one ? *scene
                : vkb_add_exposed(levels, "exposed_emission", false, *glow, exposure->image, false);
}

void vkb_expose_picture(struct vkb_levels *levels, struct vkb_exposed *exposure,
                        struct vkb_composite_source *source)
{
    const bool has_bloom = source->bloom != VKB_NO_IMAGE || levels->picture;

    if (!exposure->after)
        return;
    const uint32_t picture = has_bloom ? vkb_add_combining_pass(levels, source) : source->scene;
    if (exposure->meters_bloom)
        exposure->image = vkb_add_exposure(levels, picture);
    *source = (struct vkb_composite_source){
        .scene = vkb_add_exposed(levels, "exposed_picture", false, picture, exposure->image, true),
        .bloom = VKB_NO_IMAGE,
        .mask = VKB_NO_IMAGE,
    };
    levels->picture = 0;
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
    struct vkb_exposed exposure = vkb_begin_exposure(settings);

    levels->failed = !check_alpha(settings, image, levels->error);
    uint32_t glow = source.scene = add_input(levels, image, VKB_INPUT_IMAGE);
    if (image->has_emission)
        glow = add_input(levels, image, VKB_INPUT_EMISSION);
    if (image->has_mask)
        source.mask = add_input(levels, image, VKB_INPUT_MASK);
    vkb_expose_inputs(levels, &exposure, &source.scene, &glow);
    if (settings->values.bloom)
        source.bloom = add_bloom(levels, image, source.scene, glow, source.mask);
    vkb_expose_picture(levels, &exposure, &source);
    vkb_add_composite_pass(levels, &source, image->format);
}
