// A scene on the device: two meshes, their textures and a sky; and the matrices of a frame.
#ifndef VKB_SCENE_H
#define VKB_SCENE_H

#include "graph/params.h"
#include "scene/texture.h"
#include "vulkan/commands.h"

// As the meshes lie on the device, tightly packed.
struct vkb_vertex {
    float position[3], normal[3], colour[3], emission[3];
};

// Binding 0 holds struct vkb_vertex; binding 1, which only textured triangles have, places in two
// textures.
enum {
    VKB_VERTEX_ATTRIBUTES = 4,
    VKB_TEXTURED_ATTRIBUTES = 5,
    VKB_VERTEX_BINDINGS = 2,
    VKB_GIVEN_FLOATS = 9,
    VKB_TEXCOORDS = 4,
};
extern const VkVertexInputAttributeDescription vkb_vertex_attributes[VKB_TEXTURED_ATTRIBUTES];
extern const VkVertexInputBindingDescription vkb_vertex_bindings[VKB_VERTEX_BINDINGS];

// Triangles that have textures, by their indices among the scene's.
struct vkb_surface {
    uint32_t index_count;
    uint32_t base, emission;
};

// Host memory that the caller keeps alive; no vertices: no such mesh. The last indices are those of
// the surfaces, one after the other.
struct vkb_mesh_data {
    const float *vertices;   // position, normal and colour of each
    const float *emission;   // three floats of each, NULL: nothing emits
    const float *texcoords;  // four of each: base colour's, emission's; NULL: no surfaces
    const uint32_t *indices;
    struct vkb_surface *surfaces;
    uint32_t vertex_count, index_count, surface_count;
};

struct vkb_scene_data {
    uint64_t serial;  // differs between any two scenes but by camera or intensity; never 0
    struct vkb_mesh_data body, glow;
    struct vkb_picture_data sky;
    struct vkb_texture_data *textures;
    uint32_t texture_count;
};

struct vkb_mesh {
    struct vkb_buffer vertices, texcoords, indices;
    uint32_t plain_count;  // indices before those of the surfaces
    struct vkb_surface *surfaces;
    uint32_t surface_count;
};

struct vkb_scene {
    uint64_t serial;             // of the data that is on the device; 0: none
    struct vkb_staging staging;  // while it comes there
    struct vkb_mesh body, glow;
    struct vkb_image sky;
    struct vkb_texture *textures;
    uint32_t texture_count;
};

struct vkb_camera {
    double position[3];
    double rotation[3];  // degrees around x, y, z
    double fov;          // vertical, degrees
    double near, far;
};

// Records what brings the data to the device, in place of what the scene holds and the device must
// be done with. After it has run, vkb_scene_end says that it is there. On failure the scene holds
// nothing, or what it held; an index without a vertex is one.
bool vkb_scene_begin(const struct vkb_device *device, struct vkb_commands *commands,
                     const struct vkb_scene_data *data, struct vkb_scene *scene,
                     struct vkb_error *error);
void vkb_scene_end(const struct vkb_device *device, const struct vkb_scene_data *data,
                   struct vkb_scene *scene);
void vkb_scene_destroy(const struct vkb_device *device, struct vkb_scene *scene);

// Projection, view and model of the frame at `time` turns, column by column.
void vkb_scene_matrices(const struct vkb_camera *camera, double time, double aspect,
                        struct vkb_mesh_params *params);

#endif
