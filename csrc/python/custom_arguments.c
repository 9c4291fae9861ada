// The passes of a settings object that bring their shaders, textures and buffers along, as Python
// packs them (_custom/rows.py). All functions return false with an exception set.
#include "python/arguments.h"
#include "python/module.h"

#include <stddef.h>
#include <string.h>

enum {
    PASS_SIZE = offsetof(struct vkb_custom_pass, shader),
    RESOURCE_SIZE = offsetof(struct vkb_resource, data),
};

// What the rows of passes refer to; its content belongs to Python's objects.
struct vkb_pass_content {
    struct vkb_shader shader;
    struct vkb_resource resources[VKB_MAX_RESOURCES];
};

static bool copy_block(PyObject *block, void *to, Py_ssize_t size)
{
    const bool fits = PyBytes_Size(block) == size;

    if (fits)
        memcpy(to, PyBytes_AsString(block), (size_t)size);
    else
        PyErr_Format(PyExc_ValueError, "passes: a block of %zd bytes is needed, not of %zd", size,
                     PyBytes_Size(block));
    return fits;
}

static const char OWNER[] = "vkbloom.resource_owner";

static void leave(PyObject *capsule)
{
    vkb_owner_leave(PyCapsule_GetPointer(capsule, OWNER));
}

PyObject *vkb_resource_owner(PyObject *module, PyObject *unused)
{
    struct vkb_error error;
    struct vkb_owner *owner = vkb_owner_create(&error);

    (void)unused;
    if (!owner)
        return vkb_raise(vkb_module_state(module), &error);
    PyObject *capsule = PyCapsule_New(owner, OWNER, leave);
    if (!capsule)
        vkb_owner_leave(owner);
    return capsule;
}

// (block, bytes or None, owner or None)
static bool read_resource(PyObject *tuple, struct vkb_resource *resource)
{
    PyObject *block, *data, *owner;

    if (!PyArg_ParseTuple(tuple, "SOO:resource", &block, &data, &owner)
        || !copy_block(block, resource, RESOURCE_SIZE))
        return false;
    resource->data = data == Py_None ? NULL : PyBytes_AsString(data);
    resource->owner = owner == Py_None ? NULL : PyCapsule_GetPointer(owner, OWNER);
    return (data == Py_None || resource->data) && (owner == Py_None || resource->owner);
}

// (block, name of the shader, its SPIR-V, its hash, its threads along x and y, its bytes of shared
// memory, (resource, ...))
static bool read_pass(PyObject *tuple, struct vkb_pass_content *content,
                      struct vkb_custom_pass *pass)
{
    struct vkb_shader *shader = &content->shader;
    PyObject *block, *code, *hash, *resources;

    if (!PyArg_ParseTuple(tuple, "SsSSIIIO!:core_passes", &block, &shader->name, &code, &hash,
                          &shader->threads[0], &shader->threads[1], &shader->shared, &PyTuple_Type,
                          &resources)
        || !copy_block(block, pass, PASS_SIZE)
        || !copy_block(hash, shader->hash.bytes, sizeof shader->hash.bytes))
        return false;
    shader->code = (const void *)PyBytes_AsString(code);
    shader->size = (size_t)PyBytes_Size(code);
    pass->shader = shader;
    for (; pass->resource_count < PyTuple_Size(resources); ++pass->resource_count) {
        struct vkb_resource *resource = &content->resources[pass->resource_count];
        pass->resources[pass->resource_count] = resource;
        if (!read_resource(PyTuple_GetItem(resources, pass->resource_count), resource))
            return false;
    }
    return true;
}

static bool read_passes(struct vkb_held_passes *held, struct vkb_settings *settings)
{
    struct vkb_error error;
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
