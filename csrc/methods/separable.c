// The separable blur: loops of a vertical and a horizontal pass, in layers that are added; or the
// same kernel as one N x N pass.
#include "methods/methods.h"

#include <math.h>
#include <stdio.h>

static bool whole(double number)
{
    return floor(number) == number;
}

// Taps at whole texels are fetched. Between texels the sampler's filter is good enough for 8 bits;
// float formats are filtered by hand, for the filters of some adapters keep 8 bits of the position.
static int choose_sampling(const struct vkb_graph *graph, const struct vkb_bloom_source *source,
                           const struct vkb_pass_row *row, enum vkb_mode direction,
                           enum vkb_texel texel)
{
    const struct vkb_blur_params *params = &row->params.blur;
    const double across = (double)params->blur_scale * params->layer_scale;
    const double down = texel == TEXEL_X ? across * params->step_ratio : across;

    if (vkb_same_size(graph, row->reads[0], row->targets[0])
        && (direction == DIRECTION_VERTICAL || whole(across))
        && (direction == DIRECTION_HORIZONTAL || whole(down)))
        return SAMPLING_WHOLE;
    return source->format == VKB_FORMAT_RGBA8_UNORM ? SAMPLING_FILTER : SAMPLING_FETCH;
}

static bool add_blur(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                     const char *name, enum vkb_mode direction, uint32_t layer, uint32_t from,
                     uint32_t to, struct vkb_graph *graph, struct vkb_error *error)
{
    struct vkb_pass_row row = vkb_fullscreen_row(name, VKB_SHADER_blur_frag, to);
    const struct vkb_image_row *source_row = &graph->images[from];
    const struct vkb_sampling sampling = vkb_sampling_into(graph, to);
    const enum vkb_texel texel = (enum vkb_texel)settings->choices[VKB_CHOICE_texel];
    struct vkb_blur_params *params = &row.params.blur;

    row.reads[0] = from;
    row.read_count = 1;
    row.block = VKB_BLOCK_blur;
    params->blur_scale = settings->values.blur.blur_scale;
    params->blur_strength = settings->values.blur.blur_strength;
    params->layer_scale = settings->layers[layer].scale;
    params->layer_strength = 1.0f;
    params->target_width = sampling.width;
    params->target_height = sampling.height;
    params->limit = sampling.limit;
    params->step_ratio = (float)((double)source_row->height / source_row->width);
    for (uint32_t i = 0; i < settings->weight_count; ++i)
        params->weights[i / 4][i % 4] = settings->weights[i];
    row.constants[0] = direction;
    row.constants[1] = (int32_t)settings->weight_count - 1;
    row.constants[2] = settings->values.first_tap;
    row.constants[3] = texel;
    row.constants[4] = choose_sampling(graph, source, &row, direction, texel);
    row.constant_count = 5;
    return vkb_graph_add_pass(graph, &row, error);
}

// A blur image between the glow and the bloom, in a pass of its own.
static bool add_step(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                     const char *name, bool framebuffer, enum vkb_mode direction, uint32_t layer,
                     uint32_t *image, struct vkb_graph *graph, struct vkb_error *error)
{
    const uint32_t from = *image;

    return vkb_add_target(graph, name, source->format, source->buffers, framebuffer, image, error)
        && add_blur(settings, source, name, direction, layer, from, *image, graph, error);
}

// All of a layer but its last pass; *image is what that pass reads.
static bool add_layer(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                      uint32_t layer, uint32_t *image, struct vkb_graph *graph,
                      struct vkb_error *error)
{
    const int loops = settings->values.loops;
    const bool direct = settings->values.direct;
    const bool last_layer = layer + 1 == settings->layer_count;
    char name[VKB_NAME_SIZE];

    *image = source->glow;
    for (int loop = 0; loop < loops; ++loop) {
        const bool last = loop + 1 == loops;
        const bool shown = last && last_layer;
        const uint8_t l = (uint8_t)layer, k = (uint8_t)loop;  // both far below 256
        snprintf(name, sizeof name, shown ? "blur_vertical" : "blur_vertical_%u_%u", l, k);
        if (!direct
            && !add_step(settings, source, name, shown, DIRECTION_VERTICAL, layer, image, graph,
                         error))
            return false;
        snprintf(name, sizeof name, direct ? "blur_%u_%u" : "blur_horizontal_%u_%u", l, k);
        if (!last
            && !add_step(settings, source, name, false,
                         direct ? DIRECTION_BOTH : DIRECTION_HORIZONTAL, layer, image, graph,
                         error))
            return false;
    }
    return true;
}

// A pass that stores one image in the other's format.
static bool add_rounding(uint32_t from, uint32_t to, struct vkb_graph *graph,
                         struct vkb_error *error)
{
    struct vkb_pass_row row =
        vkb_fullscreen_row(graph->images[to].name, VKB_SHADER_extract_frag, to);
    const struct vkb_sampling sampling = vkb_sampling_into(graph, to);

    row.constants[0] = THRESHOLD_NONE;
    row.constants[1] = SAMPLING_WHOLE;
    row.constant_count = 2;
    row.reads[0] = from;
    row.read_count = 1;
    row.block = VKB_BLOCK_extract;
    row.params.extract.target_width = sampling.width;
    row.params.extract.target_height = sampling.height;
    row.params.extract.limit = sampling.limit;
    return vkb_graph_add_pass(graph, &row, error);
}

bool vkb_add_separable(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                       struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    // Blending does not round to R11G11B10: there the layers add up in an image of their own.
    const bool apart = source->format == VKB_FORMAT_RG11B10_UFLOAT && settings->layer_count > 1;
    const enum vkb_format format = apart ? VKB_FORMAT_RGBA32_FLOAT : source->format;
    uint32_t ends[MAX_LAYERS], sum;
    char name[VKB_NAME_SIZE];

    for (uint32_t layer = 0; layer < settings->layer_count; ++layer)
        if (!add_layer(settings, source, layer, &ends[layer], graph, error))
            return false;
    if (!vkb_add_target(graph, apart ? "layers" : "bloom", format, source->final, !apart, &sum,
                        error))
        return false;
    // The layers' last passes follow each other, so they share a render pass and add up in it.
    for (uint32_t layer = 0; layer < settings->layer_count; ++layer) {
        snprintf(name, sizeof name, settings->layer_count == 1 ? "bloom" : "bloom_%u", layer);
        if (!add_blur(settings, source, name,
                      settings->values.direct ? DIRECTION_BOTH : DIRECTION_HORIZONTAL, layer,
                      ends[layer], sum, graph, error))
            return false;
        struct vkb_pass_row *pass = &graph->passes[graph->pass_count - 1];
        pass->params.blur.layer_strength = settings->layers[layer].strength;
        // Blending does not clamp: sums of the largest floats must not overflow. (Half floats keep
        // their whole range; what overflows there, the composite clamps.)
        if (format == VKB_FORMAT_RGBA32_FLOAT)
            pass->params.blur.limit /= (float)settings->layer_count;
        pass->blend = layer ? VKB_BLEND_ADD : VKB_BLEND_NONE;
    }
    *bloom = sum;
    return !apart
        || (vkb_add_target(graph, "bloom", source->format, source->final, true, bloom, error)
            && add_rounding(sum, *bloom, graph, error));
}
