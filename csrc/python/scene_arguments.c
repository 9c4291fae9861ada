// A scene's arrays as the core's structs. All functions return false with an exception set.
#include "python/arguments.h"
#include "python/values.h"

// A contiguous array of at least one element, held in the scene; NULL with an exception set.
static const Py_buffer *hold(struct vkb_held_scene *scene, PyObject *array, const char *what,
                             const char *codes)
{
    Py_buffer *view = &scene->views[scene->view_count];

    if (PyObject_GetBuffer(array, view, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) < 0)
        return NULL;
    ++scene->view_count;
    if (view->len > 0 && vkb_has_element(view, codes))
        return view;
    PyErr_Format(PyExc_TypeError, "scene: %s is an array of the wrong type, \"%s\"", what,
                 view->format ? view->format : "B");
    return NULL;
}

// How many of those sizes the array holds; false with an exception set where 32 bits do not.
static bool count_elements(const Py_buffer *view, size_t size, const char *what, uint32_t *number)
{
    const size_t found = (size_t)view->len / size;

    *number = (uint32_t)found;
    if (found <= UINT32_MAX)
        return true;
    PyErr_Format(PyExc_ValueError, "scene: %zu %s are out of range, 0 to %u", found, what,
                 UINT32_MAX);
    return false;
}

// As vkb_alloc, with the exception set.
static void *allocate(size_t count, size_t size)
{
    struct vkb_error error;
    void *memory = vkb_alloc(&error, count, size);

    if (!memory)
        PyErr_NoMemory();
    return memory;
}

// (index count, base texture, emission texture) each; together they end the mesh's indices.
static bool read_surfaces(PyObject *tuple, uint32_t texture_count, struct vkb_mesh_data *mesh)
{
    const Py_ssize_t count = PyTuple_Size(tuple);
    uint64_t taken = 0;

    if (count < 1)
        return count == 0;
    mesh->surfaces = allocate((size_t)count, sizeof *mesh->surfaces);
    if (!mesh->surfaces)
        return false;
    for (Py_ssize_t i = 0; i < count; ++i) {
        struct vkb_surface *surface = &mesh->surfaces[i];
        if (!vkb_require_tuple(PyTuple_GetItem(tuple, i), "scene: surface")
            || !PyArg_ParseTuple(PyTuple_GetItem(tuple, i), "O&O&O&", vkb_read_uint32,
                                 &surface->index_count, vkb_read_uint32, &surface->base,
                                 vkb_read_uint32, &surface->emission))
            return false;
        taken += surface->index_count;
        if (surface->base >= texture_count || surface->emission >= texture_count
            || taken > mesh->index_count) {
            PyErr_Format(PyExc_ValueError,
                         "scene: surface %zd is not within the textures or indices", i);
            return false;
        }
    }
    mesh->surface_count = (uint32_t)count;
    return true;
}

// An array of `columns` floats for each of the mesh's vertices, NULL for None.
static bool read_rows(struct vkb_held_scene *scene, PyObject *array, const char *what,
                      uint32_t columns, const struct vkb_mesh_data *mesh, const float **rows)
{
    *rows = NULL;
    if (array == Py_None)
        return true;
    const Py_buffer *view = hold(scene, array, what, "f");
    if (!view)
        return false;
    *rows = view->buf;
    if ((size_t)view->len == columns * sizeof **rows * mesh->vertex_count)
        return true;
    PyErr_Format(PyExc_ValueError, "scene: %s must have the mesh's %u rows of %u", what,
                 mesh->vertex_count, columns);
    return false;
}

static bool read_mesh(struct vkb_held_scene *scene, PyObject *tuple, struct vkb_mesh_data *mesh)
{
    PyObject *vertices, *indices, *emission, *texcoords, *surfaces;

    if (tuple == Py_None)
        return true;
    if (!vkb_require_tuple(tuple, "scene: mesh")
        || !PyArg_ParseTuple(tuple, "OOOOO!", &vertices, &indices, &emission, &texcoords,
                             &PyTuple_Type, &surfaces))
        return false;
    const Py_buffer *vertex_view = hold(scene, vertices, "vertices", "f");
    const Py_buffer *index_view = vertex_view ? hold(scene, indices, "indices", "I") : NULL;
    if (!index_view)
        return false;

    *mesh = (struct vkb_mesh_data){.vertices = vertex_view->buf, .indices = index_view->buf};
    if (!count_elements(vertex_view, VKB_GIVEN_FLOATS * sizeof *mesh->vertices, "vertices",
                        &mesh->vertex_count)
        || !count_elements(index_view, sizeof *mesh->indices, "indices", &mesh->index_count)
        || !read_rows(scene, emission, "emission", 3, mesh, &mesh->emission)
        || !read_rows(scene, texcoords, "texcoords", VKB_TEXCOORDS, mesh, &mesh->texcoords)
        || !read_surfaces(surfaces, scene->data.texture_count, mesh))
        return false;
    if (mesh->surface_count > 0 && !mesh->texcoords) {
        PyErr_SetString(PyExc_ValueError, "scene: surfaces need texcoords");
        return false;
    }
    return true;
}

// The mip levels of a picture, arrays (h, w, 4); with six layers of a cube, arrays (6, n, n, 4).
static bool read_picture(struct vkb_held_scene *scene, PyObject *levels, const char *what,
                         uint32_t layers, struct vkb_picture_data *picture)
{
    const Py_ssize_t count = PyTuple_Size(levels);
    const int columns = layers > 1;

    if (count < 0 || count > VKB_MAX_MIP_LEVELS) {
        if (!PyErr_Occurred())
            PyErr_Format(PyExc_ValueError, "%s: %zd mip levels are out of range, 0 to %d", what,
                         count, VKB_MAX_MIP_LEVELS);
        return false;
    }
    picture->layers = layers;
    for (Py_ssize_t i = 0; i < count; ++i) {
        const Py_buffer *view = hold(scene, PyTuple_GetItem(levels, i), what, "Bef");
        if (!view)
            return false;
        if (i == 0 && view->ndim == 3 + columns) {
            picture->format = vkb_pixel_format(vkb_element_code(view));
            picture->height = (uint32_t)view->shape[columns];
            picture->width = (uint32_t)view->shape[columns + 1];
        }
        const uint32_t width = picture->width >> i ? picture->width >> i : 1;
        const uint32_t height = picture->height >> i ? picture->height >> i : 1;
        const size_t expected = (size_t)layers * width * height * vkb_pixel_size(picture->format);
        // A level after one of 1 x 1 is none of the picture's.
        const bool beyond = i > 0 && picture->width >> i == 0 && picture->height >> i == 0;
        const bool uneven = layers > 1 && picture->width != picture->height;
        if (picture->width == 0 || beyond || uneven || (size_t)view->len != expected
            || vkb_pixel_format(vkb_element_code(view)) != picture->format) {
            PyErr_Format(PyExc_ValueError, "%s: level %zd is not %u times %u x %u", what, i, layers,
                         width, height);
            return false;
        }
        picture->levels[i] = view->buf;
        picture->level_count = (uint32_t)i + 1;
    }
    return true;
}

// (levels, address mode along u and v, filters: of magnification, minification and mip levels), all
// but the levels as Vulkan numbers them.
static bool read_texture(struct vkb_held_scene *scene, PyObject *tuple,
                         struct vkb_texture_data *texture)
{
    enum { MODES = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE + 1, FILTERS = VK_FILTER_LINEAR + 1 };
    unsigned char modes[2], filters[3];
    PyObject *levels;

    if (!vkb_require_tuple(tuple, "texture")
        || !PyArg_ParseTuple(tuple, "O!bbbbb", &PyTuple_Type, &levels, &modes[0], &modes[1],
                             &filters[0], &filters[1], &filters[2]))
        return false;
    if (modes[0] >= MODES || modes[1] >= MODES || filters[0] >= FILTERS || filters[1] >= FILTERS
        || filters[2] >= FILTERS) {
        PyErr_SetString(PyExc_ValueError, "texture: there is no such address mode or filter");
        return false;
    }
    *texture = (struct vkb_texture_data){
        .address_modes = {(VkSamplerAddressMode)modes[0], (VkSamplerAddressMode)modes[1]},
        .mag_filter = (VkFilter)filters[0],
        .min_filter = (VkFilter)filters[1],
        .mipmap_filter = (VkSamplerMipmapMode)filters[2],
    };
    if (!read_picture(scene, levels, "texture", 1, &texture->picture))
        return false;
    if (texture->picture.level_count > 0)
        return true;
    PyErr_SetString(PyExc_ValueError, "texture: there are no levels");
    return false;
}

static bool read_textures(struct vkb_held_scene *scene, PyObject *textures)
{
    const Py_ssize_t count = PyTuple_Size(textures);

    if (count == 0)
        return true;
    scene->data.textures = allocate((size_t)count, sizeof *scene->data.textures);
    if (!scene->data.textures)
        return false;
    for (Py_ssize_t i = 0; i < count; ++i)
        if (!read_texture(scene, PyTuple_GetItem(textures, i), &scene->data.textures[i]))
            return false;
    scene->data.texture_count = (uint32_t)count;
    return true;
}

bool vkb_read_scene(PyObject *tuple, struct vkb_held_scene *scene)
{
    enum { MESHES = 2, MESH_ARRAYS = 4 };
    PyObject *body, *glow, *sky, *textures;

    if (!PyArg_ParseTuple(tuple, "O&OOO!O!", vkb_read_serial, &scene->data.serial, &body, &glow,
                          &PyTuple_Type, &sky, &PyTuple_Type, &textures))
        return false;
    // The most that there can be: views must not move once they are held.
    scene->views =
        allocate(MESHES * MESH_ARRAYS + (1 + (size_t)PyTuple_Size(textures)) * VKB_MAX_MIP_LEVELS,
                 sizeof *scene->views);
    return scene->views && read_textures(scene, textures)
        && read_mesh(scene, body, &scene->data.body) && read_mesh(scene, glow, &scene->data.glow)
        && read_picture(scene, sky, "skybox", 6, &scene->data.sky);
}

void vkb_release_scene(struct vkb_held_scene *scene)
{
    while (scene->view_count > 0)
        PyBuffer_Release(&scene->views[--scene->view_count]);
    vkb_free(scene->views);
    vkb_free(scene->data.textures);
    vkb_free(scene->data.body.surfaces);
    vkb_free(scene->data.glow.surfaces);
    *scene = (struct vkb_held_scene){0};
}

bool vkb_read_camera(PyObject *tuple, struct vkb_camera *camera)
{
    double *p = camera->position, *r = camera->rotation;

    return PyArg_ParseTuple(tuple, "(ddd)(ddd)ddd", &p[0], &p[1], &p[2], &r[0], &r[1], &r[2],
                            &camera->fov, &camera->near, &camera->far);
}
