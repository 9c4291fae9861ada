// A scene as Python packs it: blocks of bytes (_scene/blocks.py) and arrays.
#include "python/arguments.h"

#include <string.h>

// In Python "Qd28f10I32s".
struct scene_block {
    uint64_t serial;
    double glow_intensity;
    float projection[1][4], model_view[3][4], sky[3][4];
    uint32_t size[2];
    // Numbers of vertices, indices and surfaces; no vertices: there is no such mesh.
    uint32_t body[3], glow[3];
    uint32_t has_emission, texture_count;
    char shading[VKB_NAME_SIZE];
};

// In Python "9I": the sky, without levels if there is none, and textures after it.
struct picture_block {
    uint32_t format, width, height, level_count;
    uint32_t address_modes[2], filters[3];  // filters: of magnification, minification, mip levels
};

// Holds the next array, which must have that size.
static bool hold_next(struct vkb_held_scene *scene, PyObject *arrays, size_t size,
                      const void **memory)
{
    const Py_ssize_t next = (Py_ssize_t)scene->view_count;
    Py_buffer *view = &scene->views[next];

    if (PyObject_GetBuffer(PyTuple_GetItem(arrays, next), view, PyBUF_C_CONTIGUOUS) < 0)
        return false;
    ++scene->view_count;
    *memory = view->buf;
    if ((size_t)view->len == size)
        return true;
    PyErr_Format(PyExc_ValueError, "scene: an array of %zu bytes is needed, not of %zd", size,
                 view->len);
    return false;
}

static bool read_mesh(struct vkb_held_scene *scene, PyObject *arrays, const uint32_t counts[3],
                      struct vkb_mesh_data *mesh)
{
    const void *vertices, *indices, *texcoords = NULL, *surfaces = NULL;
    const size_t vertex_count = counts[0];

    if (vertex_count == 0)
        return true;
    if (!hold_next(scene, arrays, vertex_count * sizeof(struct vkb_vertex), &vertices)
        || !hold_next(scene, arrays, counts[1] * sizeof *mesh->indices, &indices)
        || (counts[2]
            && (!hold_next(scene, arrays, vertex_count * VKB_TEXCOORDS * sizeof(float), &texcoords)
                || !hold_next(scene, arrays, counts[2] * sizeof *mesh->surfaces, &surfaces))))
        return false;
    *mesh = (struct vkb_mesh_data){
        .vertices = vertices,
        .texcoords = texcoords,
        .indices = indices,
        .surfaces = surfaces,
        .vertex_count = counts[0],
        .index_count = counts[1],
        .surface_count = counts[2],
    };
    return true;
}

// The mip levels, with the layers of a cube one after the other.
static bool read_picture(struct vkb_held_scene *scene, PyObject *arrays,
                         const struct picture_block *block, uint32_t layers,
                         struct vkb_picture_data *picture)
{
    picture->layers = layers;
    picture->format = (enum vkb_format)block->format;
    picture->width = block->width;
    picture->height = block->height;
    for (; picture->level_count < block->level_count; ++picture->level_count) {
        const uint32_t i = picture->level_count;
        const size_t width = block->width >> i ? block->width >> i : 1;
        const size_t height = block->height >> i ? block->height >> i : 1;
        if (!hold_next(scene, arrays, layers * width * height * vkb_pixel_size(picture->format),
                       &picture->levels[i]))
            return false;
    }
    return true;
}

static bool read_texture(struct vkb_held_scene *scene, PyObject *arrays,
                         const struct picture_block *block, struct vkb_texture_data *texture)
{
    const uint32_t *modes = block->address_modes, *filters = block->filters;

    *texture = (struct vkb_texture_data){
        .address_modes = {(VkSamplerAddressMode)modes[0], (VkSamplerAddressMode)modes[1]},
        .mag_filter = (VkFilter)filters[0],
        .min_filter = (VkFilter)filters[1],
        .mipmap_filter = (VkSamplerMipmapMode)filters[2],
    };
    return read_picture(scene, arrays, block, 1, &texture->picture);
}

static bool allocate(const struct scene_block *block, PyObject *arrays,
                     struct vkb_held_scene *scene)
{
    struct vkb_error error;

    // Views must not move once they are held.
    scene->views = vkb_alloc(&error, (size_t)PyTuple_Size(arrays) + 1, sizeof *scene->views);
    scene->data.textures =
        vkb_alloc(&error, 1 + (size_t)block->texture_count, sizeof *scene->data.textures);
    if (!scene->views || !scene->data.textures)
        PyErr_NoMemory();
    return scene->views && scene->data.textures;
}

bool vkb_read_scene(PyObject *bytes, PyObject *pictures, PyObject *arrays,
                    struct vkb_held_scene *scene, struct vkb_source *source)
{
    struct scene_block block;
    struct picture_block picture;
    struct vkb_scene_data *data = &scene->data;

    if (PyBytes_Size(bytes) != sizeof block) {
        PyErr_SetString(PyExc_ValueError, "scene: the block has the wrong size");
        return false;
    }
    memcpy(&block, PyBytes_AsString(bytes), sizeof block);
    if (!allocate(&block, arrays, scene))
        return false;
    const char *next = PyBytes_AsString(pictures);
    data->serial = block.serial;
    data->texture_count = block.texture_count;
    memcpy(&picture, next, sizeof picture);
    bool done = read_mesh(scene, arrays, block.body, &data->body)
             && read_mesh(scene, arrays, block.glow, &data->glow)
             && read_picture(scene, arrays, &picture, 6, &data->sky);
    for (uint32_t i = 0; done && i < block.texture_count; ++i) {
        memcpy(&picture, next += sizeof picture, sizeof picture);
        done = read_texture(scene, arrays, &picture, &data->textures[i]);
    }
    *source = (struct vkb_source){
        .kind = VKB_SOURCE_SCENE,
        .scene =
            {
                .size = {block.size[0], block.size[1]},
                .glow_intensity = block.glow_intensity,
                .has_sky = data->sky.level_count > 0,
                .has_glow = data->glow.index_count > 0,
                .has_emission = block.has_emission,
                .body_textured = data->body.surface_count > 0,
                .glow_textured = data->glow.surface_count > 0,
            },
    };
    memcpy(source->scene.projection, block.projection, sizeof block.projection);
    memcpy(source->scene.model_view, block.model_view, sizeof block.model_view);
    memcpy(source->scene.sky, block.sky, sizeof block.sky);
    memcpy(source->shading, block.shading, sizeof source->shading);
    return done;
}

void vkb_release_scene(struct vkb_held_scene *scene)
{
    while (scene->view_count > 0)
        PyBuffer_Release(&scene->views[--scene->view_count]);
    vkb_free(scene->views);
    vkb_free(scene->data.textures);
    *scene = (struct vkb_held_scene){0};
}
