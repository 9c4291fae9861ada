// The Resource type: a texture or a buffer that a method brings along.
#include "python/arguments.h"
#include "python/module.h"
#include "python/values.h"

#include <string.h>

struct resource_object {
    PyObject_HEAD
    struct vkb_resource resource;
};

const struct vkb_resource *vkb_resource_of(PyObject *object)
{
    return &((struct resource_object *)object)->resource;
}

PyObject *vkb_make_resource(PyObject *module, PyObject *arguments)
{
    struct vkb_resource given = {0};
    Py_buffer data = {0};
    struct vkb_error error;
    unsigned long long serial, size;
    uint32_t kind;
    int linear;

    if (!PyArg_ParseTuple(arguments, "KO&O&(O&O&O&O&)pO&Kz*:resource", &serial, vkb_read_uint32,
                          &kind, vkb_read_uint32, &given.format, vkb_read_uint32, &given.dimensions,
                          vkb_read_uint32, &given.width, vkb_read_uint32, &given.height,
                          vkb_read_uint32, &given.depth, &linear, vkb_read_uint32, &given.border,
                          &size, &data))
        return NULL;
    given.serial = serial;
    given.kind = (enum vkb_resource_kind)kind;
    given.linear = linear;
    given.size = (size_t)size;
    struct resource_object *self = vkb_new_object(vkb_module_state(module)->resource_type);
    if (self
        && (kind >= VKB_RESOURCE_KINDS || size == 0 || (data.obj && (size_t)data.len != size)
            || (vkb_resource_is_image(&given) && (given.dimensions - 1) > 2))) {
        PyErr_SetString(PyExc_ValueError, "resource: kind, size or data are wrong");
        Py_CLEAR(self);
    }
    if (self) {
        self->resource = given;
        if (data.obj) {
            void *copy = vkb_alloc(&error, given.size, 1);
            if (copy)
                self->resource.data = memcpy(copy, data.buf, given.size);
            else
                Py_CLEAR(self);
            if (!copy)
                PyErr_NoMemory();
        }
    }
    if (data.obj)
        PyBuffer_Release(&data);
    return (PyObject *)self;
}

static void dealloc(PyObject *object)
{
    vkb_free((void *)((struct resource_object *)object)->resource.data);
    vkb_free_object(object);
}

static PyType_Slot slots[] = {
    {Py_tp_dealloc, dealloc},
    {Py_tp_doc, "A texture or a buffer that a method brings along."},
    {0},
};

PyType_Spec vkb_resource_spec = {
    .name = "vkbloom._core.Resource",
    .basicsize = sizeof(struct resource_object),
    .flags = VKB_TYPE_FLAGS,
    .slots = slots,
};
