// The deferred HDR system: draws surfaces into a G-buffer, blurs their emission, and shades from
// the G-buffer.
#include "methods/methods.h"

#include <float.h>
#include <math.h>

enum { ALBEDO, NORMAL, POSITION, BRIGHTNESS, GBUFFER_COLOURS };

static const enum vkb_format HDR = VKB_FORMAT_RGBA16_FLOAT;

struct gbuffer {
    uint32_t colours[GBUFFER_COLOURS];
    uint32_t depth;
};

static bool add_images(struct vkb_size size, struct vkb_graph *graph, struct gbuffer *gbuffer,
                       struct vkb_error *error)
{
    static const char *const names[GBUFFER_COLOURS] = {
        [ALBEDO] = "albedo",
        [NORMAL] = "normal",
        [POSITION] = "position",
        [BRIGHTNESS] = "brightness",
    };

    for (int i = 0; i < GBUFFER_COLOURS; ++i)
        if (!vkb_add_target(graph, names[i], HDR, size, true, &gbuffer->colours[i], error))
            return false;
    return vkb_add_target(graph, "depth", VKB_FORMAT_DEPTH32_FLOAT, size, true, &gbuffer->depth,
                          error);
}

// Sets all images of the G-buffer as targets of the row.
static void set_targets(const struct gbuffer *gbuffer, struct vkb_pass_row *row)
{
    for (int i = 0; i < GBUFFER_COLOURS; ++i)
        row->targets[i] = gbuffer->colours[i];
    row->target_count = GBUFFER_COLOURS;
    row->depth = gbuffer->depth;
}

// `glow` (VKB_NO_IMAGE: none) gets only the glow mesh, as in the forward system. It has its own
// depth: a glow mesh repeats surfaces of the body, which would flicker in a common depth buffer.
static bool add_gbuffer(const struct vkb_scene_source *source, const struct vkb_mesh_params *params,
                        uint32_t glow, struct gbuffer *gbuffer, struct vkb_graph *graph,
                        struct vkb_error *error)
{
    const int emitters = source->has_emission && glow != VKB_NO_IMAGE ? 2 : 1;
    struct vkb_mesh_params stored = *params;
    struct vkb_pass_row row;

    stored.limit = vkb_formats[HDR].limit;
    if (!add_images(source->size, graph, gbuffer, error))
        return false;
    if (source->has_sky) {
        row = vkb_scene_row("skybox", VKB_GEOMETRY_SKYBOX, &vkb_shader_gbuffer_sky_frag, 0, 0,
                            &stored);
        set_targets(gbuffer, &row);
        if (!vkb_graph_add_pass(graph, &row, error))
            return false;
    }
    row = vkb_scene_row("gbuffer", VKB_GEOMETRY_BODY, &vkb_shader_gbuffer_body_frag, 0, 0, &stored);
    row.constants.emitters = emitters;
    set_targets(gbuffer, &row);
    if (!vkb_add_mesh(&row, source->body_textured, &vkb_shader_gbuffer_body_textured_frag, graph,
                      error))
        return false;
    if (glow == VKB_NO_IMAGE)
        return true;
    row = vkb_fullscreen_row("glow_light", &vkb_shader_gbuffer_glow_frag, 0);
    row.constants.emitters = emitters;
    row.reads[0] = glow;
    row.read_count = 1;
    row.blend = VKB_BLEND_ADD;
    set_targets(gbuffer, &row);
    return vkb_graph_add_pass(graph, &row, error);
}

static bool add_bloom(const struct vkb_settings *settings, struct vkb_size size, uint32_t scene,
                      uint32_t brightness, struct vkb_graph *graph, uint32_t *bloom,
                      struct vkb_error *error)
{
    struct vkb_bloom_source source = {
        .scene = scene,
        .glow = brightness,
        .mask = VKB_NO_IMAGE,
        .buffers = vkb_bloom_size(settings, size),
        .final = size,
        .format = settings->format ? settings->format : HDR,
    };
    const enum vkb_format extracted = vkb_first_format(settings, source.format);
    const bool as_it_is = source.buffers.width == size.width && source.buffers.height == size.height
                       && extracted == HDR && vkb_threshold_mode(settings) == THRESHOLD_NONE;

    if (!as_it_is
        && (!vkb_add_target(graph, "extracted", extracted, source.buffers, false, &source.glow,
                            error)
            || !vkb_add_threshold(settings, brightness, VKB_NO_IMAGE, source.glow, graph, error)))
        return false;
    return vkb_add_bloom(settings, &source, graph, bloom, error);
}

static bool add_lighting(const struct gbuffer *gbuffer, struct vkb_size size,
                         struct vkb_graph *graph, uint32_t *scene, struct vkb_error *error)
{
    if (!vkb_add_target(graph, "scene", HDR, size, true, scene, error))
        return false;
    struct vkb_pass_row row = vkb_fullscreen_row("scene", &vkb_shader_lighting_frag, *scene);
    for (int i = 0; i < GBUFFER_COLOURS; ++i)
        row.reads[i] = gbuffer->colours[i];
    row.read_count = GBUFFER_COLOURS;
    row.block = VKB_BLOCK_lighting;
    row.params.lighting.limit = vkb_formats[HDR].limit;
    return vkb_graph_add_pass(graph, &row, error);
}

bool vkb_build_deferred(const struct vkb_settings *settings, const struct vkb_scene_source *source,
                        struct vkb_graph *graph, struct vkb_error *error)
{
    struct vkb_mesh_params params = vkb_scene_params(source);
    struct gbuffer gbuffer;
    struct vkb_composite_source composite = {
        .scene = VKB_NO_IMAGE,
        .bloom = VKB_NO_IMAGE,
        .mask = VKB_NO_IMAGE,
        .lit = vkb_has_glare(settings),
    };
    // Passes that were given at run time may read the scene.
    const bool scene_first = settings->method == VKB_METHOD_CUSTOM;
    uint32_t glow = VKB_NO_IMAGE;

    if (settings->values.bloom && source->has_glow) {
        struct vkb_mesh_params lamp = params;
        lamp.glow_intensity = (float)fmin(source->glow_intensity, FLT_MAX);
        if (!vkb_add_glow(settings, source, &lamp, HDR, source->size, false, THRESHOLD_NONE, graph,
                          &glow, error))
            return false;
    }
    return add_gbuffer(source, &params, glow, &gbuffer, graph, error)
        && (!scene_first || add_lighting(&gbuffer, source->size, graph, &composite.scene, error))
        && (!settings->values.bloom
            || add_bloom(settings, source->size, composite.scene, gbuffer.colours[BRIGHTNESS],
                         graph, &composite.bloom, error))
        && (scene_first || add_lighting(&gbuffer, source->size, graph, &composite.scene, error))
        && vkb_add_composite(settings, &composite, VKB_FORMAT_RGBA8_UNORM, graph, error);
}
