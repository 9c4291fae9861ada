// The SceneContents type: what is the same in all frames of a scene. Blocks of bytes and arrays, as
// Python packs them (_scene/blocks.py).
#include "python/arguments.h"
#include "python/module.h"

#include <string.h>

// In Python "Q8I".
struct contents_block {
    uint64_t serial;
    // Numbers of vertices, indices and surfaces; no vertices: there is no such mesh.
    uint32_t body[3], glow[3];
    uint32_t has_emission, texture_count;
};

// In Python "d44f2I32s".
struct frame_block {
    double glow_intensity;
    float projection[1][4], model_view[3][4], sky[3][4], before[3][4], jitter[1][4];
    uint32_t size[2];
    char shading[VKB_NAME_SIZE];
};

// In Python "9I": the sky, without levels if there is none, and textures after it.
struct picture_block {
    uint32_t format, width, height, level_count;
    uint32_t address_modes[2], filters[3];  // filters: of magnification, minification, mip levels
};

// Holds the next array, which must have that size and such numbers.
static bool hold_next(struct vkb_contents_object *contents, PyObject *arrays, size_t size,
                      char type, const void **memory)
{
    const Py_ssize_t next = (Py_ssize_t)contents->view_count;
    Py_buffer *view = &contents->views[next];

    if (next >= PyTuple_Size(arrays))
        return vkb_refuse("scene: the %zd arrays are fewer than its blocks count", next);
    // Releasing a view that is not held is safe.
    ++contents->view_count;
    if (!vkb_hold_bytes(PyTuple_GetItem(arrays, next), "scene", type, 0, size, view))
        return false;
    *memory = view->buf;
    return true;
}

// The device reads vertices without a check.
static bool check_indices(const struct vkb_mesh_data *mesh)
{
    uint32_t last = 0;

    for (uint32_t i = 0; i < mesh->index_count; ++i)
        last = mesh->indices[i] > last ? mesh->indices[i] : last;
    return last < mesh->vertex_count
        || vkb_refuse("scene: the index %u is beyond the mesh's %u vertices", last,
                      mesh->vertex_count);
}

static bool check_surfaces(const struct vkb_mesh_data *mesh, uint32_t texture_count)
{
    uint64_t count = 0;

    for (uint32_t i = 0; i < mesh->surface_count; ++i) {
        const struct vkb_surface *surface = &mesh->surfaces[i];
        if (surface->base >= texture_count || surface->emission >= texture_count)
            return vkb_refuse("scene: the textures %u and %u are not among its %u", surface->base,
                              surface->emission, texture_count);
        count += surface->index_count;
    }
    return count <= mesh->index_count
        || vkb_refuse("scene: surfaces of %llu indices are more than the mesh's %u",
                      (unsigned long long)count, mesh->index_count);
}

static bool read_mesh(struct vkb_contents_object *contents, PyObject *arrays,
                      const uint32_t counts[3], struct vkb_mesh_data *mesh)
{
    const void *vertices = NULL, *indices = NULL, *texcoords = NULL, *surfaces = NULL;
    const size_t vertex_count = counts[0];

    if (vertex_count == 0)
        return true;
    if (counts[1] == 0 || counts[1] % 3)
        return vkb_refuse("scene: %u indices are not a positive multiple of 3", counts[1]);
    if (!hold_next(contents, arrays, vertex_count * sizeof(struct vkb_vertex), VKB_FLOAT32,
                   &vertices)
        || !hold_next(contents, arrays, counts[1] * sizeof *mesh->indices, VKB_UINT32, &indices)
        || (counts[2]
            && (!hold_next(contents, arrays, vertex_count * VKB_TEXCOORDS * sizeof(float),
                           VKB_FLOAT32, &texcoords)
                || !hold_next(contents, arrays, counts[2] * sizeof *mesh->surfaces, VKB_UINT32,
                              &surfaces))))
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
    return check_indices(mesh) && check_surfaces(mesh, contents->data.texture_count);
}

static bool check_picture(const struct picture_block *block)
{
    const uint32_t format = block->format, width = block->width, height = block->height;

    if (format != VKB_FORMAT_RGBA8_UNORM && format != VKB_FORMAT_RGBA16_FLOAT
        && format != VKB_FORMAT_RGBA32_FLOAT)
        return vkb_refuse("scene: the format %u is not one of pictures", format);
    if (width == 0 || height == 0 || width > VKB_MAX_SIDE || height > VKB_MAX_SIDE)
        return vkb_refuse("scene: a picture of %u x %u is out of range, sides of 1 to %d", width,
                          height, VKB_MAX_SIDE);
    // A level after that of 1 x 1 is none.
    return (block->level_count <= VKB_MAX_MIP_LEVELS
            && (width | height) >> (block->level_count - 1) > 0)
        || vkb_refuse("scene: a picture of %u x %u has no %u levels", width, height,
                      block->level_count);
}

// The mip levels, with the layers of a cube one after the other.
static bool read_picture(struct vkb_contents_object *contents, PyObject *arrays,
                         const struct picture_block *block, uint32_t layers,
                         struct vkb_picture_data *picture)
{
    static const char types[] = {[VKB_FORMAT_RGBA8_UNORM] = VKB_UINT8,
                                 [VKB_FORMAT_RGBA16_FLOAT] = VKB_FLOAT16,
                                 [VKB_FORMAT_RGBA32_FLOAT] = VKB_FLOAT32};

    if (block->level_count == 0)
        return true;
    if (!check_picture(block))
        return false;
    if (layers == 6 && block->width != block->height)
        return vkb_refuse("scene: a sky of %u x %u is not square", block->width, block->height);
    picture->layers = layers;
    picture->format = (enum vkb_format)block->format;
    picture->width = block->width;
    picture->height = block->height;
    for (; picture->level_count < block->level_count; ++picture->level_count) {
        const uint32_t i = picture->level_count;
        const size_t width = block->width >> i ? block->width >> i : 1;
        const size_t height = block->height >> i ? block->height >> i : 1;
        if (!hold_next(contents, arrays, layers * width * height * vkb_pixel_size(picture->format),
                       types[picture->format], &picture->levels[i]))
            return false;
    }
    return true;
}

static bool read_texture(struct vkb_contents_object *contents, PyObject *arrays,
                         const struct picture_block *block, struct vkb_texture_data *texture)
{
    const uint32_t *modes = block->address_modes, *filters = block->filters;

    for (int axis = 0; axis < 2; ++axis)
        if (modes[axis] > VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE)
            return vkb_refuse("scene: the address mode %u is not 0 to 2", modes[axis]);
    for (int which = 0; which < 3; ++which)
        if (filters[which] > VK_FILTER_LINEAR)
            return vkb_refuse("scene: the filter %u is not 0 or 1", filters[which]);
    if (block->level_count == 0)
        return vkb_refuse("scene: a texture has no levels");
    *texture = (struct vkb_texture_data){
        .address_modes = {(VkSamplerAddressMode)modes[0], (VkSamplerAddressMode)modes[1]},
        .mag_filter = (VkFilter)filters[0],
        .min_filter = (VkFilter)filters[1],
        .mipmap_filter = (VkSamplerMipmapMode)filters[2],
    };
    return read_picture(contents, arrays, block, 1, &texture->picture);
}

static bool allocate(const struct contents_block *block, PyObject *arrays,
                     struct vkb_contents_object *contents)
{
    struct vkb_error error;

    // Views must not move once they are held.
    contents->views = vkb_alloc(&error, (size_t)PyTuple_Size(arrays) + 1, sizeof *contents->views);
    contents->data.textures =
        vkb_alloc(&error, 1 + (size_t)block->texture_count, sizeof *contents->data.textures);
    if (!contents->views || !contents->data.textures)
        PyErr_NoMemory();
    return contents->views && contents->data.textures;
}

// `pictures` has a block for the sky and one for each texture.
static bool check_block(const struct contents_block *block, PyObject *pictures)
{
    const size_t size = (1 + (size_t)block->texture_count) * sizeof(struct picture_block);

    if ((size_t)PyBytes_Size(pictures) != size)
        return vkb_refuse("scene: blocks of pictures of %zu bytes are needed, not of %zd", size,
                          PyBytes_Size(pictures));
    return block->serial > 0 || vkb_refuse("scene: the serial 0 is out of range, at least 1");
}

// Without anything to draw there is nothing to upload either.
static bool check_content(const struct vkb_scene_data *data)
{
    return data->body.index_count || data->glow.index_count || data->sky.level_count
        || vkb_refuse("scene: there is nothing in it; give it a mesh or a sky");
}

static bool copy_block(PyObject *bytes, void *block, size_t size)
{
    if ((size_t)PyBytes_Size(bytes) != size)
        return vkb_refuse("scene: the block has the wrong size");
    memcpy(block, PyBytes_AsString(bytes), size);
    return true;
}

static bool read_contents(PyObject *bytes, PyObject *pictures, PyObject *arrays,
                          struct vkb_contents_object *contents)
{
    struct contents_block block;
    struct picture_block picture;
    struct vkb_scene_data *data = &contents->data;

    if (!copy_block(bytes, &block, sizeof block) || !check_block(&block, pictures)
        || !allocate(&block, arrays, contents))
        return false;
    const char *next = PyBytes_AsString(pictures);
    data->serial = block.serial;
    data->texture_count = block.texture_count;
    contents->has_emission = block.has_emission;
    memcpy(&picture, next, sizeof picture);
    bool done = read_mesh(contents, arrays, block.body, &data->body)
             && read_mesh(contents, arrays, block.glow, &data->glow)
             && read_picture(contents, arrays, &picture, 6, &data->sky);
    for (uint32_t i = 0; done && i < block.texture_count; ++i) {
        memcpy(&picture, next += sizeof picture, sizeof picture);
        done = read_texture(contents, arrays, &picture, &data->textures[i]);
    }
    return done && check_content(data);
}

PyObject *vkb_scene_contents(PyObject *module, PyObject *arguments)
{
    PyObject *block, *pictures, *arrays;

    if (!PyArg_ParseTuple(arguments, "SSO!:scene_contents", &block, &pictures, &PyTuple_Type,
                          &arrays))
        return NULL;
    struct vkb_contents_object *self = vkb_new_object(vkb_module_state(module)->contents_type);
    if (self && !read_contents(block, pictures, arrays, self))
        Py_CLEAR(self);
    return (PyObject *)self;
}

bool vkb_read_frame(PyObject *bytes, const struct vkb_contents_object *contents,
                    struct vkb_source *source)
{
    const struct vkb_scene_data *data = &contents->data;
    struct frame_block block;

    if (!copy_block(bytes, &block, sizeof block))
        return false;
    if (!memchr(block.shading, 0, sizeof block.shading))
        return vkb_refuse("scene: the name of the shading is too long");
    *source = (struct vkb_source){
        .kind = VKB_SOURCE_SCENE,
        .scene =
            {
                .size = {block.size[0], block.size[1]},
                .glow_intensity = block.glow_intensity,
                .has_sky = data->sky.level_count > 0,
                .has_glow = data->glow.index_count > 0,
                .has_emission = contents->has_emission,
                .body_textured = data->body.surface_count > 0,
                .glow_textured = data->glow.surface_count > 0,
            },
    };
    memcpy(source->scene.projection, block.projection, sizeof block.projection);
    memcpy(source->scene.model_view, block.model_view, sizeof block.model_view);
    memcpy(source->scene.sky, block.sky, sizeof block.sky);
    memcpy(source->scene.before, block.before, sizeof block.before);
    memcpy(source->scene.jitter, block.jitter, sizeof block.jitter);
    memcpy(source->shading, block.shading, sizeof source->shading);
    return true;
}

static int traverse(PyObject *object, visitproc visit, void *arg)
{
    const struct vkb_contents_object *self = (struct vkb_contents_object *)object;

    Py_VISIT(Py_TYPE(object));
    for (size_t i = 0; i < self->view_count; ++i)
        Py_VISIT(self->views[i].obj);
    return 0;
}

static void dealloc(PyObject *object)
{
    struct vkb_contents_object *self = (struct vkb_contents_object *)object;

    PyObject_GC_UnTrack(object);
    while (self->view_count > 0) {
        --self->view_count;
        PyBuffer_Release(&self->views[self->view_count]);
    }
    vkb_free(self->views);
    vkb_free(self->data.textures);
    vkb_free_object(object);
}

static PyType_Slot slots[] = {
    {Py_tp_dealloc, dealloc},
    {Py_tp_traverse, traverse},
    {Py_tp_doc, "The meshes and pictures of a scene, held as long as a frame needs them."},
    {0},
};

PyType_Spec vkb_contents_spec = {
    .name = "vkbloom._core.SceneContents",
    .basicsize = sizeof(struct vkb_contents_object),
    .flags = VKB_TYPE_FLAGS | Py_TPFLAGS_HAVE_GC,
    .slots = slots,
};
