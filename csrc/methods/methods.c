#include "methods/methods.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const struct method {
    bool (*add)(const struct vkb_settings *, const struct vkb_bloom_source *, struct vkb_graph *,
                uint32_t *, struct vkb_error *);
    bool published;
} methods[VKB_METHOD_COUNT] = {
#define METHOD_ROW(constant, name, published) [VKB_METHOD_##constant] = {vkb_add_##name, published},
    VKB_METHODS(METHOD_ROW)
#undef METHOD_ROW
};

bool vkb_is_published(const struct vkb_settings *settings)
{
    return methods[settings->method].published;
}

bool vkb_add_bloom(const struct vkb_settings *settings, const struct vkb_bloom_source *source,
                   struct vkb_graph *graph, uint32_t *bloom, struct vkb_error *error)
{
    return methods[settings->method].add(settings, source, graph, bloom, error);
}

enum vkb_mode vkb_threshold_mode(const struct vkb_settings *settings)
{
    if (!settings->thresholded || vkb_is_published(settings))
        return THRESHOLD_NONE;
    return settings->values.mesh.knee > 0.0f ? THRESHOLD_KNEE : THRESHOLD_HARD;
}

static uint32_t scaled(double scale, uint32_t side)
{
    double size = floor(scale * side);
    return size < 1.0 ? 1 : (uint32_t)size;
}

bool vkb_check_sizes(const struct vkb_settings *settings, const char *name, struct vkb_size frame,
                     uint32_t max_side, struct vkb_error *error)
{
    return vkb_check_size(name, frame.width, frame.height, max_side, error)
        && (!settings->bloom_width
            || vkb_check_size("bloom_size", settings->bloom_width, settings->bloom_height, max_side,
                              error));
}

struct vkb_size vkb_bloom_size(const struct vkb_settings *settings, struct vkb_size frame)
{
    if (settings->bloom_width)
        return (struct vkb_size){settings->bloom_width, settings->bloom_height};
    return (struct vkb_size){
        .width = scaled(settings->values.bloom_scale, frame.width),
        .height = scaled(settings->values.bloom_scale, frame.height),
    };
}

struct vkb_pass_row vkb_fullscreen_row(const char *name, enum vkb_shader fragment, uint32_t target)
{
    struct vkb_pass_row row;

    // All of the parameters' union: an initializer would reach its first member only.
    memset(&row, 0, sizeof row);
    snprintf(row.name, sizeof row.name, "%s", name);
    row.geometry = VKB_GEOMETRY_FULLSCREEN;
    row.vertex = VKB_SHADER_fullscreen_vert;
    row.shader = fragment;
    row.targets[0] = target;
    row.target_count = 1;
    row.depth = VKB_NO_IMAGE;
    return row;
}

struct vkb_sampling vkb_sampling_into(const struct vkb_graph *graph, uint32_t target)
{
    const struct vkb_image_row *row = &graph->images[target];

    return (struct vkb_sampling){
        .width = (int)row->width,
        .height = (int)row->height,
        .limit = vkb_formats[row->format].limit,
    };
}

bool vkb_same_size(const struct vkb_graph *graph, uint32_t a, uint32_t b)
{
    const struct vkb_image_row *first = &graph->images[a], *second = &graph->images[b];
    return first->width == second->width && first->height == second->height;
}

bool vkb_add_target(struct vkb_graph *graph, const char *name, enum vkb_format format,
                    struct vkb_size size, bool framebuffer, uint32_t *index,
                    struct vkb_error *error)
{
    struct vkb_image_row row = {
        .format = format,
        .width = size.width,
        .height = size.height,
        .framebuffer = framebuffer,
    };

    snprintf(row.name, sizeof row.name, "%s", name);
    return vkb_graph_add_image(graph, &row, index, error);
}

// The luminances of 8-bit colours, (2126 r + 7152 g + 722 b) / 10000 / 255, are whole multiples of
// 1 / 1275000. Half way between two of them, the threshold is out of reach of the rounding of
// samplers and shaders, which else lift some colours over it that are no brighter than it.
static float between_levels(float threshold)
{
    const double steps = 1275000.0;
    // What a float makes of a decimal number up to 1 is less than a tenth of a step away from it.
    return (float)((floor(threshold * steps + 0.1) + 0.5) / steps);
}

bool vkb_add_extract(const struct vkb_settings *settings, uint32_t image, uint32_t glow,
                     struct vkb_graph *graph, struct vkb_error *error)
{
    struct vkb_pass_row row =
        vkb_fullscreen_row(graph->images[glow].name, VKB_SHADER_extract_frag, glow);
    const struct vkb_sampling sampling = vkb_sampling_into(graph, glow);

    row.constants[0] = vkb_threshold_mode(settings);
    // Never the sampler's filter: it would spread NaN, and a threshold magnifies what it rounds.
    row.constants[1] = vkb_same_size(graph, image, glow) ? SAMPLING_WHOLE : SAMPLING_FETCH;
    row.constant_count = 2;
    row.reads[0] = image;
    row.read_count = 1;
    row.block = VKB_BLOCK_extract;
    row.params.extract = (struct vkb_extract_params){
        .target_width = sampling.width,
        .target_height = sampling.height,
        .limit = sampling.limit,
    };
    if (row.constants[0] != THRESHOLD_NONE) {
        row.params.extract.threshold = settings->values.extract.threshold;
        row.params.extract.knee = settings->values.extract.knee;
        if (row.constants[0] == THRESHOLD_HARD
            && graph->images[image].format == VKB_FORMAT_RGBA8_UNORM)
            row.params.extract.threshold = between_levels(row.params.extract.threshold);
    }
    return vkb_graph_add_pass(graph, &row, error);
}

bool vkb_add_composite(const struct vkb_settings *settings, uint32_t scene, uint32_t bloom,
                       enum vkb_format format, struct vkb_graph *graph, struct vkb_error *error)
{
    uint32_t final;
    struct vkb_image_row image = {
        .name = "final",
        .format = format,
        .width = graph->images[scene].width,
        .height = graph->images[scene].height,
        .channels = graph->images[scene].channels,
        .framebuffer = true,
    };

    if (!vkb_graph_add_image(graph, &image, &final, error))
        return false;
    struct vkb_pass_row row = vkb_fullscreen_row("final", VKB_SHADER_composite_frag, final);
    const bool off = bloom == VKB_NO_IMAGE;
    // Floats have no levels to round to.
    const bool dither = settings->values.dither && format == VKB_FORMAT_RGBA8_UNORM;
    row.constants[0] = off ? COMPOSITE_OFF : settings->choices[VKB_CHOICE_composite];
    row.constants[1] = settings->choices[VKB_CHOICE_tonemap];
    row.constants[2] = settings->choices[VKB_CHOICE_encoding];
    row.constants[3] = dither;
    row.constant_count = 4;
    row.reads[0] = scene;
    // Every binding of the shader must be filled, also one that this variant does not read.
    row.reads[1] = off ? scene : bloom;
    row.read_count = 2;
    row.block = VKB_BLOCK_composite;
    row.params.composite = settings->values.composite;
    row.params.composite.limit = vkb_formats[image.format].limit;
    row.params.composite.noise_seed = dither ? settings->values.dither_seed : 0;
    return vkb_graph_add_pass(graph, &row, error);
}
