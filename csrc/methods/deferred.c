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

static struct gbuffer add_images(struct vkb_levels *levels, struct vkb_size size)
{
    static const char *const names[GBUFFER_COLOURS] = {
        [ALBEDO] = "albedo",
        [NORMAL] = "normal",
        [POSITION] = "position",
        [BRIGHTNESS] = "brightness",
    };
    struct gbuffer gbuffer;

    for (int i = 0; i < GBUFFER_COLOURS; ++i)
        gbuffer.colours[i] = vkb_levels_target(levels, names[i], HDR, size, true);
    gbuffer.depth = vkb_levels_target(levels, "depth", VKB_FORMAT_DEPTH32_FLOAT, size, true);
    return gbuffer;
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
static struct gbuffer add_gbuffer(struct vkb_levels *levels, const struct vkb_scene_source *source,
                                  const struct vkb_mesh_params *params, uint32_t glow)
{
    const int emitters = source->has_emission && glow != VKB_NO_IMAGE ? 2 : 1;
    const struct gbuffer gbuffer = add_images(levels, source->size);
    struct vkb_pass_row row;

    if (source->has_sky) {
        row = vkb_scene_row("skybox", VKB_GEOMETRY_SKYBOX, &vkb_shader_gbuffer_sky_frag, 0, 0,
                            params);
        set_targets(&gbuffer, &row);
        vkb_levels_pass(levels, &row);
    }
    row = vkb_scene_row("gbuffer", VKB_GEOMETRY_BODY, &vkb_shader_gbuffer_body_frag, 0, 0, params);
    row.constants.emitters = emitters;
    set_targets(&gbuffer, &row);
    vkb_add_mesh_pass(levels, &row, source->body_textured, &vkb_shader_gbuffer_body_textured_frag);
    if (glow == VKB_NO_IMAGE)
        return gbuffer;
    row = vkb_fullscreen_row("glow_light", &vkb_shader_gbuffer_glow_frag, 0);
    row.constants.emitters = emitters;
    vkb_read_only(&row, glow);
    row.blend = VKB_BLEND_ADD;
    set_targets(&gbuffer, &row);
    vkb_levels_pass(levels, &row);
    return gbuffer;
}

static uint32_t add_bloom(struct vkb_levels *levels, const struct vkb_time_stages *stages,
                          struct vkb_size size, uint32_t scene, uint32_t brightness)
{
    const struct vkb_settings *settings = levels->settings;
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
                       && extracted == HDR && vkb_threshold_mode(settings) == THRESHOLD_NONE
                       && !stages->exposes_bloom && !stages->resolves_scene;

    if (!as_it_is) {
        source.glow = vkb_levels_target(levels, "extracted", extracted, source.buffers, false);
        vkb_add_threshold_pass(levels, brightness, VKB_NO_IMAGE, source.glow);
    }
    return vkb_add_bloom(levels, &source);
}

static uint32_t add_lighting(struct vkb_levels *levels, const struct gbuffer *gbuffer,
                             struct vkb_size size)
{
    const uint32_t scene = vkb_levels_target(levels, "scene", HDR, size, true);
    struct vkb_pass_row row = vkb_fullscreen_row("scene", &vkb_shader_lighting_frag, scene);

    vkb_read_at(&row, SLOT_ALBEDO, gbuffer->colours[ALBEDO]);
    vkb_read_at(&row, SLOT_NORMAL, gbuffer->colours[NORMAL]);
    vkb_read_at(&row, SLOT_POSITION, gbuffer->colours[POSITION]);
    vkb_read_at(&row, SLOT_BRIGHTNESS, gbuffer->colours[BRIGHTNESS]);
    vkb_levels_pass(levels, &row);
    return scene;
}

// The motion and the depth of the surfaces, which temporal anti-aliasing reads.
static void add_motion(struct vkb_levels *levels, const struct vkb_scene_source *source,
                       const struct gbuffer *gbuffer, struct vkb_time_stages *stages)
{
    if (!levels->settings->taa_engine)
        return;
    const uint32_t motion =
        vkb_levels_target(levels, "motion", VKB_FORMAT_RGBA32_FLOAT, source->size, true);
    if (levels->failed)
        return;
    struct vkb_pass_row row = vkb_fullscreen_row("motion", &vkb_shader_motion_frag, motion);
    row.constants.engine = (int)levels->settings->taa_engine;
    row.block = VKB_BLOCK_mesh;
    row.params.mesh = vkb_scene_params(source);
    vkb_read_only(&row, gbuffer->colours[POSITION]);
    vkb_levels_pass(levels, &row);
    stages->taa.motion_x = motion;
    stages->taa.packed = true;
    stages->resolves_glow = true;
}

void vkb_build_deferred(struct vkb_levels *levels, const struct vkb_scene_source *source)
{
    const struct vkb_settings *settings = levels->settings;
    const struct vkb_mesh_params params = vkb_scene_params(source);
    struct vkb_composite_source composite = {
        .scene = VKB_NO_IMAGE,
        .bloom = VKB_NO_IMAGE,
        .mask = VKB_NO_IMAGE,
        .lit = vkb_has_glare(settings),
    };
    struct vkb_time_stages stages = vkb_begin_time_stages(settings);
    const bool scene_first =
        vkb_method_of(settings)->custom || settings->exposure_engine || settings->taa_engine;
    uint32_t glow = VKB_NO_IMAGE;

    if (settings->values.bloom && source->has_glow) {
        struct vkb_mesh_params lamp = params;
        lamp.glow_intensity = (float)fmin(source->glow_intensity, FLT_MAX);
        glow = vkb_add_glow_pass(levels, source, &lamp, HDR, source->size, false, THRESHOLD_NONE);
    }
    const struct gbuffer gbuffer = add_gbuffer(levels, source, &params, glow);
    if (scene_first)
        composite.scene = add_lighting(levels, &gbuffer, source->size);
    uint32_t brightness = gbuffer.colours[BRIGHTNESS];
    add_motion(levels, source, &gbuffer, &stages);
    vkb_add_time_stages_before(levels, &stages, &composite.scene, &brightness);
    if (settings->values.bloom)
        composite.bloom = add_bloom(levels, &stages, source->size, composite.scene, brightness);
    if (!scene_first)
        composite.scene = add_lighting(levels, &gbuffer, source->size);
    vkb_add_time_stages_after(levels, &stages, &composite);
    vkb_add_composite_pass(levels, &composite, VKB_FORMAT_RGBA8_UNORM);
}
