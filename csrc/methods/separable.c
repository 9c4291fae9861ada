// The separable blur: layers that are added, each of them loops of a vertical and a horizontal
// pass; or the same kernel as one N x N pass.
#include "methods/methods.h"
#include "passes/blur.h"

#include <stdio.h>

// Taps between texels use the sampler's filter in 8 bits. Float formats are filtered in the shader,
// since the samplers of some adapters keep only 8 bits of the position.
static struct vkb_pass_row blur_row(const struct vkb_settings *settings,
                                    const struct vkb_bloom_source *source, const char *name,
                                    enum vkb_mode direction, uint32_t layer, double strength,
                                    uint32_t from, uint32_t to, const struct vkb_graph *graph)
{
    const struct vkb_image_row *read = &graph->images[from];
    const double scale = settings->values.blur_scale * settings->layers[layer].scale;
    // A step of one texel in x is height / width texels in y.
    const bool width_steps = settings->choices[VKB_CHOICE_texel] == TEXEL_X;
    // The strength does not change the centre tap. If the taps start at 0, the centre is added
    // twice more, with the strength (as in the loop of the forward system's outline).
    const double side = settings->values.blur_strength;
    const double centre = settings->values.first_tap ? 1.0 : 1.0 + 2.0 * side;
    struct vkb_blur blur = {
        .direction = direction,
        .count = settings->weight_count,
        .gain = strength,
        .step_x = scale,
        .step_y = width_steps ? scale * read->height / read->width : scale,
        .filter = source->format == VKB_FORMAT_RGBA8_UNORM,
    };

    for (uint32_t tap = 0; tap < blur.count; ++tap)
        blur.weights[tap] = (tap ? side : centre) * settings->weights[tap];
    return vkb_blur_row(graph, name, &blur, from, to);
}

// Adds a pass to an intermediate image between the glow and the bloom.
static bool add_step(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                     const char *name, bool framebuffer, enum vkb_mode direction, uint32_t layer,
                     uint32_t *image, struct vkb_graph *graph, struct vkb_error *error)
{
    const uint32_t from = *image;

    if (!vkb_add_target(graph, name, source->format, source->buffers, framebuffer, image, error))
        return false;
    const struct vkb_pass_row row =
        blur_row(settings, source, name, direction, layer, 1.0, from, *image, graph);
    return vkb_graph_add_pass(graph, &row, error);
}

// Adds all passes of a layer except the last one. *image is the image that the last one reads.
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
        const uint8_t l = (uint8_t)layer, k = (uint8_t)loop;  // both are far below 256
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

// Adds a pass that copies `from` to `to`, which has another format.
static bool add_rounding(uint32_t from, uint32_t to, struct vkb_graph *graph,
                         struct vkb_error *error)
{
    struct vkb_pass_row row =
        vkb_fullscreen_row(graph->images[to].name, &vkb_shader_threshold_frag, to);

    row.constants.threshold_mode = THRESHOLD_NONE;
    row.constants.sampling = SAMPLING_TEXEL;
    row.reads[0] = from;
    vkb_apply_mask(&row, VKB_NO_IMAGE);
    row.block = VKB_BLOCK_threshold;
    VKB_SET_TARGET(&row, threshold, &graph->images[to]);
    return vkb_graph_add_pass(graph, &row, error);
}

bool vkb_add_separable(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                       struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    // Blending does not round as the shaders do, so such layers are added in a separate image.
    const bool apart = vkb_is_rounded(source->format) && settings->layer_count > 1;
    const enum vkb_format format = apart ? VKB_FORMAT_RGBA32_FLOAT : source->format;
    uint32_t ends[MAX_LAYERS], sum;
    char name[VKB_NAME_SIZE];

    for (uint32_t layer = 0; layer < settings->layer_count; ++layer)
        if (!add_layer(settings, source, layer, &ends[layer], graph, error))
            return false;
    if (!vkb_add_target(graph, apart ? "layers" : "bloom", format, source->final, !apart, &sum,
                        error))
        return false;
    // The last passes of the layers are consecutive, so they share a render pass, in which blending
    // adds them.
    for (uint32_t layer = 0; layer < settings->layer_count; ++layer) {
        snprintf(name, sizeof name, settings->layer_count == 1 ? "bloom" : "bloom_%u", layer);
        struct vkb_pass_row row = blur_row(
            settings, source, name, settings->values.direct ? DIRECTION_BOTH : DIRECTION_HORIZONTAL,
            layer, settings->layers[layer].strength, ends[layer], sum, graph);
        // Blending does not clamp, and sums of the largest single floats must not overflow. (Half
        // floats have their complete range: the composite clamps a sum that overflows.)
        if (format == VKB_FORMAT_RGBA32_FLOAT)
            row.params.blur.limit /= (float)settings->layer_count;
        row.blend = layer == 0          ? VKB_BLEND_NONE
                  : source->blurs_alpha ? VKB_BLEND_ADD_RGBA
                                        : VKB_BLEND_ADD;
        if (!vkb_graph_add_pass(graph, &row, error))
            return false;
    }
    *bloom = sum;
    return !apart
        || (vkb_add_target(graph, "bloom", source->format, source->final, true, bloom, error)
            && add_rounding(sum, *bloom, graph, error));
}
