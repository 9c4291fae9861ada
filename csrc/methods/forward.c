// The forward system: draws the glow mesh into its own buffer, blurs it, and adds it to the lit
// scene. Without a glow mesh, the emission of the body takes its place.
#include "methods/methods.h"

// The bloom buffers of the forward system have this size for every frame size. Published methods
// derive the sizes from the frame.
static const struct vkb_size FORWARD_BUFFERS = {256, 256};

struct vkb_size vkb_forward_buffers(const struct vkb_settings *settings, struct vkb_size frame)
{
    if (!settings->bloom_width && settings->values.bloom_scale == 1.0
        && !vkb_method_of(settings)->published)
        return FORWARD_BUFFERS;
    return vkb_bloom_size(settings, frame);
}

static uint32_t add_scene(struct vkb_levels *levels, const struct vkb_scene_source *source,
                          const struct vkb_mesh_params *params)
{
    const uint32_t scene =
        vkb_levels_target(levels, "scene", VKB_FORMAT_RGBA8_UNORM, source->size, true);
    const uint32_t depth =
        vkb_levels_target(levels, "depth", VKB_FORMAT_DEPTH32_FLOAT, source->size, true);

    if (source->has_sky) {
        const struct vkb_pass_row sky = vkb_scene_row(
            "skybox", VKB_GEOMETRY_SKYBOX, &vkb_shader_skybox_frag, scene, depth, params);
        vkb_levels_pass(levels, &sky);
    }
    struct vkb_pass_row body =
        vkb_scene_row("scene", VKB_GEOMETRY_BODY, &vkb_shader_phong_frag, scene, depth, params);
    body.constants.emitters = vkb_body_glows(source);
    vkb_add_mesh_pass(levels, &body, source->body_textured, &vkb_shader_phong_textured_frag);
    return scene;
}

void vkb_build_forward(struct vkb_levels *levels, const struct vkb_scene_source *source)
{
    const struct vkb_settings *settings = levels->settings;
    const struct vkb_mesh_params params = vkb_scene_params(source);
    struct vkb_composite_source composite = {
        .scene = VKB_NO_IMAGE,
        .bloom = VKB_NO_IMAGE,
        .mask = VKB_NO_IMAGE,
        .lit = vkb_has_glare(settings),
    };

    const bool scene_first = vkb_method_of(settings)->custom;

    if (settings->exposure_engine)
        levels->failed = !vkb_fail(levels->error, VKB_ERROR_VALUE,
                                   "exposure: a forward scene has 8 bits, and no light above 1; "
                                   "shading 'deferred' has it");
    if (settings->taa_engine)
        levels->failed = !vkb_fail(levels->error, VKB_ERROR_VALUE,
                                   "taa: a forward scene has no motion; shading 'deferred' has it");
    if (scene_first)
        composite.scene = add_scene(levels, source, &params);
    if (settings->values.bloom) {
        struct vkb_bloom_source glow = {
            .scene = composite.scene,
            .mask = VKB_NO_IMAGE,
            .buffers = vkb_forward_buffers(settings, source->size),
            .final = source->size,
            .format = settings->format ? settings->format : VKB_FORMAT_RGBA8_UNORM,
        };
        struct vkb_mesh_params lamp = params;
        // The intensity applies to the deferred system only: 8 bits cannot hold radiance.
        lamp.glow_intensity = 1.0f;
        glow.glow =
            vkb_add_glow_pass(levels, source, &lamp, vkb_first_format(settings, glow.format),
                              glow.buffers, true, vkb_threshold_mode(settings));
        composite.bloom = vkb_add_bloom(levels, &glow);
    }
    if (!scene_first)
        composite.scene = add_scene(levels, source, &params);
    vkb_add_composite_pass(levels, &composite, VKB_FORMAT_RGBA8_UNORM);
}
