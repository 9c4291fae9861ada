#include "passes/scene.h"

#include <stdio.h>
#include <string.h>

struct vkb_mesh_params vkb_scene_params(const struct vkb_scene_source *source)
{
    struct vkb_mesh_params params = {0};

    memcpy(params.projection, source->projection, sizeof params.projection);
    memcpy(params.model_view, source->model_view, sizeof params.model_view);
    memcpy(params.sky, source->sky, sizeof params.sky);
    memcpy(params.before, source->before, sizeof params.before);
    memcpy(params.jitter, source->jitter, sizeof params.jitter);
    return params;
}

struct vkb_pass_row vkb_scene_row(const char *name, enum vkb_geometry geometry,
                                  const struct vkb_shader *fragment, uint32_t target,
                                  uint32_t depth, const struct vkb_mesh_params *params)
{
    struct vkb_pass_row row = vkb_fullscreen_row(name, fragment, target);

    row.geometry = geometry;
    row.vertex = geometry == VKB_GEOMETRY_SKYBOX ? &vkb_shader_skybox_vert
               : geometry == VKB_GEOMETRY_GLOW   ? &vkb_shader_glow_vert
                                                 : &vkb_shader_mesh_vert;
    row.depth = depth;
    row.load = VKB_LOAD_CLEAR;
    row.block = VKB_BLOCK_mesh;
    row.params.mesh = *params;
    return row;
}

void vkb_add_mesh_pass(struct vkb_levels *levels, const struct vkb_pass_row *row, bool has_textures,
                       const struct vkb_shader *textured)
{
    struct vkb_pass_row second;

    vkb_levels_pass(levels, row);
    if (!has_textures)
        return;
    memcpy(&second, row, sizeof second);
    snprintf(second.name, sizeof second.name, "%.16s_textured", row->name);
    second.textured = true;
    second.vertex = row->geometry == VKB_GEOMETRY_GLOW ? &vkb_shader_glow_textured_vert
                                                       : &vkb_shader_mesh_textured_vert;
    second.shader = textured;
    vkb_levels_pass(levels, &second);
}

uint32_t vkb_add_glow_pass(struct vkb_levels *levels, const struct vkb_scene_source *source,
                           const struct vkb_mesh_params *params, enum vkb_format format,
                           struct vkb_size size, bool framebuffer, enum vkb_mode threshold)
{
    const bool own = vkb_body_glows(source);
    const uint32_t glow = vkb_add_first_image(levels, format, size, framebuffer);
    const uint32_t depth =
        vkb_levels_target(levels, "glow_depth", VKB_FORMAT_DEPTH32_FLOAT, size, framebuffer);
    struct vkb_pass_row row =
        vkb_scene_row("glow", own ? VKB_GEOMETRY_BODY : VKB_GEOMETRY_GLOW,
                      own ? &vkb_shader_emission_frag : &vkb_shader_glow_frag, glow, depth, params);
    row.constants.threshold_mode = threshold;
    if (threshold != THRESHOLD_NONE)
        vkb_params_read(row.block, &levels->settings->values, &row.params);
    vkb_add_mesh_pass(levels, &row, own ? source->body_textured : source->glow_textured,
                      own ? &vkb_shader_emission_textured_frag : &vkb_shader_glow_textured_frag);
    return glow;
}
