// The forward system: the glow mesh into a buffer of its own, blurred, added to the lit scene.
#include "methods.h"

#include <stdio.h>
#include <string.h>

// The bloom buffers of the forward system, whatever the frame's size. Published methods have rules
// of their own, which start from the frame.
static const struct vkb_size FORWARD_BUFFERS = {256, 256};

static struct vkb_size buffer_size(const struct vkb_settings *settings, struct vkb_size frame)
{
    if (!settings->bloom_width && settings->values.bloom_scale == 1.0
        && !vkb_is_published(settings))
        return FORWARD_BUFFERS;
    return vkb_bloom_size(settings, frame);
}

static bool add_target(struct vkb_graph *graph, const char *name, enum vkb_format format,
                       struct vkb_size size, uint32_t *index, struct vkb_error *error)
{
    struct vkb_image_row row = {
        .format = format,
        .width = size.width,
        .height = size.height,
        .framebuffer = true,
    };

    snprintf(row.name, sizeof row.name, "%s", name);
    return vkb_graph_add_image(graph, &row, index, error);
}

static struct vkb_pass_row scene_row(const char *name, enum vkb_geometry geometry,
                                     enum vkb_shader vertex, enum vkb_shader fragment,
                                     uint32_t target, uint32_t depth,
                                     const struct vkb_mesh_params *matrices)
{
    struct vkb_pass_row row = vkb_fullscreen_row(name, fragment, target);

    row.geometry = geometry;
    row.vertex = vertex;
    row.depth = depth;
    row.load = VKB_LOAD_CLEAR;
    row.block = VKB_BLOCK_mesh;
    row.params.mesh = *matrices;
    return row;
}

static bool add_glow(const struct vkb_settings *settings, struct vkb_size size,
                     enum vkb_format format, const struct vkb_mesh_params *matrices,
                     struct vkb_graph *graph, uint32_t *glow, struct vkb_error *error)
{
    uint32_t depth;

    if (!add_target(graph, "glow", format, size, glow, error)
        || !add_target(graph, "glow_depth", VKB_FORMAT_DEPTH32_FLOAT, size, &depth, error))
        return false;
    struct vkb_pass_row row = scene_row("glow", VKB_GEOMETRY_GLOW, VKB_SHADER_mesh_vert,
                                        VKB_SHADER_glow_frag, *glow, depth, matrices);
    row.constants[0] = vkb_threshold_mode(settings);
    row.constant_count = 1;
    if (row.constants[0] != THRESHOLD_NONE) {
        row.params.mesh.threshold = settings->values.mesh.threshold;
        row.params.mesh.knee = settings->values.mesh.knee;
    }
    return vkb_graph_add_pass(graph, &row, error);
}

static bool add_scene(const struct vkb_forward *forward, const struct vkb_mesh_params *matrices,
                      struct vkb_graph *graph, uint32_t *scene, struct vkb_error *error)
{
    uint32_t depth;

    if (!add_target(graph, "scene", VKB_FORMAT_RGBA8_UNORM, forward->size, scene, error)
        || !add_target(graph, "depth", VKB_FORMAT_DEPTH32_FLOAT, forward->size, &depth, error))
        return false;
    if (forward->has_sky) {
        struct vkb_pass_row sky = scene_row("skybox", VKB_GEOMETRY_SKYBOX, VKB_SHADER_skybox_vert,
                                            VKB_SHADER_skybox_frag, *scene, depth, matrices);
        if (!vkb_graph_add_pass(graph, &sky, error))
            return false;
    }
    struct vkb_pass_row body = scene_row("scene", VKB_GEOMETRY_BODY, VKB_SHADER_mesh_vert,
                                         VKB_SHADER_phong_frag, *scene, depth, matrices);
    return vkb_graph_add_pass(graph, &body, error);
}

bool vkb_build_forward(const struct vkb_settings *settings, const struct vkb_forward *forward,
                       struct vkb_graph *graph, struct vkb_error *error)
{
    struct vkb_mesh_params matrices;
    uint32_t scene, bloom = VKB_NO_IMAGE;

    memset(&matrices, 0, sizeof matrices);
    vkb_scene_matrices(&forward->camera, forward->time,
                       (double)forward->size.width / forward->size.height, &matrices);
    if (settings->values.bloom) {
        struct vkb_bloom_source source = {
            .buffers = buffer_size(settings, forward->size),
            .final = forward->size,
            .format = settings->format ? settings->format : VKB_FORMAT_RGBA8_UNORM,
        };
        if (!add_glow(settings, source.buffers, source.format, &matrices, graph, &source.glow,
                      error)
            || !vkb_add_bloom(settings, &source, graph, &bloom, error))
            return false;
    }
    return add_scene(forward, &matrices, graph, &scene, error)
        && vkb_add_composite(settings, scene, bloom, graph, error);
}
