// The graph of an image from the host: it is reduced to the size of the bloom buffers, thresholded
// and blurred, and the result is added to it. If there is an emission, the bloom is made from that
// instead.
#include "methods/methods.h"

#include <stdio.h>

struct inputs {
    uint32_t image, emission, mask;  // VKB_NO_IMAGE: none
};

static bool add_input(const struct vkb_image_source *image, enum vkb_input_kind kind,
                      struct vkb_graph *graph, uint32_t *index, struct vkb_error *error)
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
    return vkb_graph_add_image(graph, &row, index, error);
}

static bool add_inputs(const struct vkb_image_source *image, struct vkb_graph *graph,
                       struct inputs *inputs, struct vkb_error *error)
{
    *inputs = (struct inputs){VKB_NO_IMAGE, VKB_NO_IMAGE, VKB_NO_IMAGE};
    return add_input(image, VKB_INPUT_IMAGE, graph, &inputs->image, error)
        && (!image->has_emission
            || add_input(image, VKB_INPUT_EMISSION, graph, &inputs->emission, error))
        && (!image->has_mask || add_input(image, VKB_INPUT_MASK, graph, &inputs->mask, error));
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
    if (settings->format == VKB_FORMAT_RG11B10_UFLOAT)
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "alpha: '%s' needs bloom buffers that have an alpha, and rg11b10ufloat has "
                        "none",
                        name);
    return true;
}

static bool add_bloom(const struct vkb_settings *settings, const struct vkb_image_source *image,
                      const struct inputs *inputs, struct vkb_graph *graph, uint32_t *bloom,
                      struct vkb_error *error)
{
    const uint32_t from = image->has_emission ? inputs->emission : inputs->image;
    struct vkb_bloom_source source = {
        .scene = inputs->image,
        .mask = inputs->mask,
        .blurs_alpha = settings->choices[VKB_CHOICE_alpha] == ALPHA_BLUR,
        .buffers = vkb_bloom_size(settings, image->size),
        .final = image->size,
        .format = settings->format ? settings->format : image->format,
    };

    if (!vkb_add_first(settings, graph, vkb_first_format(settings, source.format), source.buffers,
                       true, &source.glow, error)
        || !vkb_add_threshold(settings, from, inputs->mask, source.glow, graph, error)
        || !vkb_add_bloom(settings, &source, graph, bloom, error))
        return false;
    for (uint32_t i = 0; source.blurs_alpha && i < graph->pass_count; ++i)
        graph->passes[i].constants.alpha = ALPHA_BLUR;
    return true;
}

bool vkb_build_image(const struct vkb_settings *settings, const struct vkb_image_source *image,
                     struct vkb_graph *graph, struct vkb_error *error)
{
    struct vkb_composite_source source = {
        .bloom = VKB_NO_IMAGE,
        .apart = image->has_emission,
        .lit = vkb_has_glare(settings),
        .alpha = (enum vkb_alpha)settings->choices[VKB_CHOICE_alpha],
    };
    struct inputs inputs;

    if (!check_alpha(settings, image, error) || !add_inputs(image, graph, &inputs, error)
        || (settings->values.bloom
            && !add_bloom(settings, image, &inputs, graph, &source.bloom, error)))
        return false;
    source.scene = inputs.image;
    source.mask = inputs.mask;
    return vkb_add_composite(settings, &source, image->format, graph, error);
}
