#include "passes/composite.h"

// The formula of the composite. The light of a bloom from another image is not in the scene, so the
// scene does not lose it.
static int composite_of(const struct vkb_settings *settings,
                        const struct vkb_composite_source *source)
{
    const struct vkb_method_row *method = vkb_method_of(settings);
    const int composite = settings->choices[VKB_CHOICE_composite];

    if (source->bloom == VKB_NO_IMAGE)
        return COMPOSITE_OFF;
    if (composite == COMPOSITE_MIX && source->apart)
        return COMPOSITE_ADD;
    if (composite == COMPOSITE_ADD)
        return method->composite_add;
    if (composite == COMPOSITE_SCREEN && method->composite_screen)
        return method->composite_screen;
    return composite;
}

// A picture that a custom method has written takes the place of the scene, and contains the bloom:
// only glare is added to it.
static struct vkb_composite_source composited(const struct vkb_levels *levels,
                                              const struct vkb_composite_source *source)
{
    return levels->picture ? (struct vkb_composite_source){
        .scene = levels->picture,
        .bloom = source->lit ? source->bloom : VKB_NO_IMAGE,
        .mask = VKB_NO_IMAGE,
        .lit = source->lit,
        .alpha = source->alpha,
    } : *source;
}

// Adds the image of a composite, and describes the pass with scene, bloom and mask.
static struct vkb_pass_row describe_composite(struct vkb_levels *levels,
                                              const struct vkb_composite_source *source,
                                              struct vkb_image_row *image, uint32_t *index)
{
    const struct vkb_settings *settings = levels->settings;
    const struct vkb_image_row *scene = &levels->graph->images[source->scene];

    image->width = scene->width;
    image->height = scene->height;
    image->channels = scene->channels;
    *index = vkb_levels_add(levels, image);
    struct vkb_pass_row row = vkb_fullscreen_row(image->name, &vkb_shader_composite_frag, *index);
    const bool off = source->bloom == VKB_NO_IMAGE;
    row.constants.composite = composite_of(settings, source);
    row.constants.alpha = off ? ALPHA_KEEP : source->alpha;
    row.constants.masked = row.constants.composite == COMPOSITE_MIX && source->mask != VKB_NO_IMAGE;
    row.constants.lit = source->lit;
    row.constants.exposed_scene = vkb_method_of(settings)->exposes_scene && !off;
    vkb_read_only(&row, source->scene);
    vkb_read_at(&row, SLOT_MASK, row.constants.masked ? source->mask : VKB_NO_IMAGE);
    vkb_read_at(&row, SLOT_BLOOM, source->bloom);
    row.block = VKB_BLOCK_composite;
    vkb_params_read(row.block, &settings->values, &row.params);
    row.params.composite.limit = vkb_formats[image->format].limit;
    row.params.composite.noise_seed = 0;
    return row;
}

void vkb_add_composite_pass(struct vkb_levels *levels, const struct vkb_composite_source *given,
                            enum vkb_format format)
{
    const struct vkb_settings *settings = levels->settings;
    struct vkb_image_row image = {.name = "final", .format = format, .framebuffer = true};
    uint32_t final;
    if (levels->failed)
        return;
    const struct vkb_composite_source source = composited(levels, given);
    struct vkb_pass_row row = describe_composite(levels, &source, &image, &final);
    // Float formats have no quantization levels to dither.
    const bool dither = settings->values.dither && format == VKB_FORMAT_RGBA8_UNORM;
    row.constants.tonemap = settings->choices[VKB_CHOICE_tonemap];
    row.constants.encoding = settings->choices[VKB_CHOICE_encoding];
    row.constants.dither = dither;
    row.params.composite.noise_seed = dither ? settings->values.dither_seed : 0;
    vkb_levels_pass(levels, &row);
}

uint32_t vkb_add_combining_pass(struct vkb_levels *levels, const struct vkb_composite_source *given)
{
    struct vkb_image_row image = {.name = "combined", .format = VKB_FORMAT_RGBA32_FLOAT};
    uint32_t combined = 0;
    if (levels->failed)
        return 0;
    const struct vkb_composite_source source = composited(levels, given);
    struct vkb_pass_row row = describe_composite(levels, &source, &image, &combined);
    row.params.composite.exposure = 0.0f;
    vkb_levels_pass(levels, &row);
    return combined;
}

bool vkb_is_composite(const struct vkb_pass_row *pass)
{
    return vkb_computes(pass, VKB_BLOCK_composite) && pass->constants.composite != COMPOSITE_OFF;
}

bool vkb_ends_bloom(const struct vkb_pass_row *pass)
{
    return vkb_is_composite(pass)
        || (vkb_transposes(pass, VKB_BLOCK_composite) && pass->constants.by == BY_MIXED);
}
