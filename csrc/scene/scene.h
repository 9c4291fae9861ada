// A scene on the device: two meshes, their textures and a sky. The matrices of a frame.
#ifndef VKB_SCENE_H
#define VKB_SCENE_H

#include "graph/params.h"
#include "vulkan/commands.h"
#include "vulkan/staging.h"

// The vertex layout on the device, tightly packed. The fourth numbers are the emission.
struct vkb_vertex {
    float position[4], normal[4], colour[4];
};

// Binding 0 has struct vkb_vertex. Binding 1, only for textured triangles, has the coordinates in
// two textures.
enum {
    VKB_VERTEX_ATTRIBUTES = 3,
    VKB_TEXTURED_ATTRIBUTES = 4,
    VKB_VERTEX_BINDINGS = 2,
    VKB_TEXCOORDS = 4,
};
extern const VkVertexInputAttributeDescription vkb_vertex_attributes[VKB_TEXTURED_ATTRIBUTES];
extern const VkVertexInputBindingDescription vkb_vertex_bindings[VKB_VERTEX_BINDINGS];

// Consecutive triangles with the same pair of textures, as indices into the scene's textures.
struct vkb_surface {
    uint32_t index_count;
    uint32_t base, emission;
};

// Host memory that the caller keeps alive. No vertices: there is no such mesh. The last indices are
// those of the surfaces, in order.
struct vkb_mesh_data {
    const struct vkb_vertex *vertices;
    const float *texcoords;  // four for each: base colour, emission; NULL: no surfaces
    const uint32_t *indices;
    const struct vkb_surface *surfaces;
    uint32_t vertex_count, index_count, surface_count;
};

// Textures of meshes, each with its own sampler.
struct vkb_texture_data {
    struct vkb_picture_data picture;
    VkSamplerAddressMode address_modes[2];  // horizontal, vertical
    VkFilter mag_filter, min_filter;
    VkSamplerMipmapMode mipmap_filter;
};

struct vkb_texture {
    struct vkb_image image;
    VkSampler sampler;
};

struct vkb_scene_data {
    uint64_t serial;  // equal only for scenes that differ in camera or intensity; never 0
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
    uint64_t serial;             // of the data on the device; 0: none
    struct vkb_staging staging;  // during the upload
    struct vkb_mesh body, glow;
    struct vkb_image sky;
    struct vkb_texture *textures;
    uint32_t texture_count;
};

// Records the upload of the data, which replaces the scene's content. The device must not use the
// old content any more. Call vkb_scene_end when the commands have run. On failure the scene is
// empty or unchanged.
bool vkb_scene_begin(const struct vkb_device *device, struct vkb_commands *commands,
                     const struct vkb_scene_data *data, struct vkb_scene *scene,
                     struct vkb_error *error);
void vkb_scene_end(const struct vkb_device *device, const struct vkb_scene_data *data,
                   struct vkb_scene *scene);
void vkb_scene_destroy(const struct vkb_device *device, struct vkb_scene *scene);

#endif
