// The passes of a settings object that bring their shaders, textures and buffers along. All
// functions return false with an exception set.
#include "python/arguments.h"
#include "python/values.h"

#include <stddef.h>
#include <string.h>

// What Python packs (_custom/rows.py).
enum {
    PASS_SIZE = offsetof(struct vkb_custom_pass, shader),
    RESOURCE_SIZE = offsetof(struct vkb_resource, data),
};

// What the rows of passes refer to; its content belongs to Python's objects.
struct vkb_pass_content {
    struct vkb_shader shader;
    struct vkb_resource resources[VKB_MAX_RESOURCES];
};

static bool refuse(const char *what)
{
    PyErr_Format(PyExc_ValueError, "passes: %s has the wrong size or values out of their ranges",
                 what);
    return false;
}

// (block, bytes or None)
static bool read_resource(PyObject *tuple, struct vkb_resource *resource)
{
    PyObject *block, *data;

    if (!vkb_require_tuple(tuple, "passes: resource")
        || !PyArg_ParseTuple(tuple, "SO:resource", &block, &data))
        return false;
    if (PyBytes_Size(block) != RESOURCE_SIZE)
        return refuse("a resource");
    memcpy(resource, PyBytes_AsString(block), RESOURCE_SIZE);
    if (data != Py_None && !(resource->data = PyBytes_AsString(data)))
        return false;
    return (resource->size > 0 && resource->kind < VKB_RESOURCE_KINDS
            && (data == Py_None || (uint64_t)PyBytes_Size(data) == resource->size)
            && (!vkb_resource_is_image(resource)
                || (resource->dimensions >= 1 && resource->dimensions <= 3)))
        || refuse("a resource");
}

static bool read_resources(PyObject *tuple, struct vkb_pass_content *content,
                           struct vkb_custom_pass *pass)
{
    const Py_ssize_t count = PyTuple_Size(tuple);

    if (count > VKB_MAX_RESOURCES)
        return refuse("the number of textures and buffers");
    for (; pass->resource_count < count; ++pass->resource_count) {
        struct vkb_resource *resource = &content->resources[pass->resource_count];
        pass->resources[pass->resource_count] = resource;
        if (!read_resource(PyTuple_GetItem(tuple, pass->resource_count), resource))
            return false;
    }
    return true;
}

static bool read_shader(PyObject *code, PyObject *hash, struct vkb_shader *shader)
{
    enum { MAGIC = 0x07230203, HEADER_BYTES = 20 };
    const Py_ssize_t size = PyBytes_Size(code);

    shader->code = (const void *)PyBytes_AsString(code);
    shader->size = (size_t)size;
    if (size < HEADER_BYTES || size % 4 != 0 || *shader->code != MAGIC) {
        PyErr_Format(PyExc_ValueError, "shader: %s is not SPIR-V", shader->name);
        return false;
    }
    if (PyBytes_Size(hash) != sizeof shader->hash.bytes)
        return refuse("a hash");
    memcpy(shader->hash.bytes, PyBytes_AsString(hash), sizeof shader->hash.bytes);
    return true;
}

// Strings end in their arrays, and no number leads out of one.
static bool is_valid(const struct vkb_custom_pass *pass)
{
    bool valid = *pass->name && !pass->name[VKB_NAME_SIZE - 1] && pass->read_count <= VKB_MAX_READS
              && !pass->block_width == !pass->block_height;

    for (uint32_t i = 0; valid && i < pass->read_count; ++i)
        valid = !pass->reads[i][VKB_NAME_SIZE - 1];
    return valid;
}

// (block, name of the shader, its SPIR-V, its hash, its threads along x and y, its bytes of shared
// memory, (resource, ...))
static bool read_pass(PyObject *tuple, struct vkb_pass_content *content,
                      struct vkb_custom_pass *pass)
{
    struct vkb_shader *shader = &content->shader;
    PyObject *block, *code, *hash, *resources;

    if (!vkb_require_tuple(tuple, "core_passes")
        || !PyArg_ParseTuple(tuple, "SsSSIIIO!:core_passes", &block, &shader->name, &code, &hash,
                             &shader->threads[0], &shader->threads[1], &shader->shared,
                             &PyTuple_Type, &resources))
        return false;
    if (PyBytes_Size(block) != PASS_SIZE)
        return refuse("a pass");
    memcpy(pass, PyBytes_AsString(block), PASS_SIZE);
    pass->shader = shader;
    return (is_valid(pass) || refuse("a pass")) && read_shader(code, hash, shader)
        && read_resources(resources, content, pass);
}

static bool read_passes(struct vkb_held_passes *held, struct vkb_settings *settings)
{
    struct vkb_error error;

    if (!vkb_require_tuple(held->tuple, "core_passes"))
        return false;
    const Py_ssize_t count = PyTuple_Size(held->tuple);
    held->rows = vkb_alloc(&error, (size_t)count + 1, sizeof *held->rows);
    held->content = vkb_alloc(&error, (size_t)count + 1, sizeof *held->content);
    if (!held->rows || !held->content) {
        PyErr_NoMemory();
        return false;
    }
    settings->passes = held->rows;
    for (; settings->pass_count < count; ++settings->pass_count)
        if (!read_pass(PyTuple_GetItem(held->tuple, settings->pass_count),
                       &held->content[settings->pass_count], &held->rows[settings->pass_count]))
            return false;
    return true;
}

bool vkb_hold_passes(const struct vkb_module_state *state, PyObject *object, uint32_t max_side,
                     const struct vkb_source *source, struct vkb_held_passes *held,
                     struct vkb_settings *settings)
{
    struct vkb_size frame, buffers;
    struct vkb_error error = {0};

    if (settings->method != VKB_METHOD_CUSTOM || !settings->values.bloom)
        return true;
    if (!vkb_source_sizes(source, settings, max_side, &frame, &buffers, &error)) {
        vkb_raise(state, &error);
        return false;
    }
    held->tuple = PyObject_CallMethod(object, "core_passes", "(II)(II)", frame.width, frame.height,
                                      buffers.width, buffers.height);
    return held->tuple && read_passes(held, settings);
}

void vkb_release_passes(struct vkb_held_passes *held)
{
    Py_CLEAR(held->tuple);
    vkb_free(held->rows);
    vkb_free(held->content);
    held->rows = NULL;
    held->content = NULL;
}
