// A scene on the device: two meshes and a sky; and the matrices of a frame.
#ifndef VKB_SCENE_H
#define VKB_SCENE_H

#include "commands.h"
#include "memory.h"
#include "params.h"

// As the meshes lie on the device, tightly packed.
struct vkb_vertex {
    float position[3], normal[3], colour[3], emission[3];
};

enum { VKB_VERTEX_ATTRIBUTES = 4, VKB_GIVEN_FLOATS = 9, VKB_MAX_MIP_LEVELS = 16 };
extern const VkVertexInputAttributeDescription vkb_vertex_attributes[VKB_VERTEX_ATTRIBUTES];

// Host memory that the caller keeps alive; no vertices: no such mesh.
struct vkb_mesh_data {
    const float *vertices;  // position, normal and colour of each
    const float *emission;  // three floats of each, NULL: nothing emits
    const uint32_t *indices;
    uint32_t vertex_count, index_count;
};

// Mip levels of six square faces each, tightly packed; no levels: no sky.
struct vkb_sky_data {
    enum vkb_format format;
    uint32_t size, level_count;
    const void *levels[VKB_MAX_MIP_LEVELS];
};

struct vkb_scene_data {
    uint64_t serial;  // differs between any two scenes; never 0
    struct vkb_mesh_data body, glow;
    struct vkb_sky_data sky;
};

struct vkb_mesh {
    struct vkb_buffer vertices, indices;
    uint32_t index_count;
};

struct vkb_scene {
    uint64_t serial;  // of the data that is on the device; 0: none
    struct vkb_mesh body, glow;
    struct vkb_image sky;
};

struct vkb_camera {
    double position[3];
    double rotation[3];  // degrees around x, y, z
    double fov;          // vertical, degrees
    double near, far;
};

// Replaces what the scene holds, unless it holds that data already. On failure it holds nothing, or
// what it held; an index without a vertex is one.
bool vkb_scene_load(struct vkb_device *device, struct vkb_commands *commands,
                    const struct vkb_scene_data *data, struct vkb_scene *scene,
                    struct vkb_error *error);
void vkb_scene_destroy(const struct vkb_device *device, struct vkb_scene *scene);

// Projection, view and model of the frame at `time` turns, column by column.
void vkb_scene_matrices(const struct vkb_camera *camera, double time, double aspect,
                        struct vkb_mesh_params *params);

#endif
