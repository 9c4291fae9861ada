// The rows that draw a scene's meshes and its sky.
#ifndef VKB_SCENE_PASSES_H
#define VKB_SCENE_PASSES_H

#include "passes/pass.h"

// A frame of a scene.
struct vkb_scene_source {
    // Those of the camera and of the body (python/vkbloom/_scene/view.py).
    float projection[1][4], model_view[3][4], sky[3][4];
    // From the place of the body in the view to that in the frame before; by how much the picture
    // is moved, in units of which it has two along each side.
    float before[3][4], jitter[1][4];
    struct vkb_size size;
    double glow_intensity;
    bool has_sky, has_glow, has_emission;  // the body's materials emit
    bool body_textured, glow_textured;     // some of the mesh's triangles have textures
};

// The parameters that all draws of a frame have.
struct vkb_mesh_params vkb_scene_params(const struct vkb_scene_source *source);

// Whether the forward system draws the body's emission, which then glows: a glow mesh takes its
// place.
static inline bool vkb_body_glows(const struct vkb_scene_source *source)
{
    return source->has_emission && !source->has_glow;
}

// Adds the pass that draws the glow mesh into "glow" and "glow_depth", with a threshold of this
// mode. If the body glows instead, draws its emission.
uint32_t vkb_add_glow_pass(struct vkb_levels *levels, const struct vkb_scene_source *source,
                           const struct vkb_mesh_params *params, enum vkb_format format,
                           struct vkb_size size, bool framebuffer, enum vkb_mode threshold);

// A row that draws a mesh or the sky with a depth test. The caller may add targets.
struct vkb_pass_row vkb_scene_row(const char *name, enum vkb_geometry geometry,
                                  const struct vkb_shader *fragment, uint32_t target,
                                  uint32_t depth, const struct vkb_mesh_params *params);

// Adds the row, which draws a mesh. If some triangles have textures, adds a second row that draws
// these with the fragment shader `textured`.
void vkb_add_mesh_pass(struct vkb_levels *levels, const struct vkb_pass_row *row, bool has_textures,
                       const struct vkb_shader *textured);

#endif
