// Single Python objects as numbers, names and tuples.
#include "python/values.h"

bool vkb_require_tuple(PyObject *object, const char *what)
{
    if (!PyTuple_Check(object))
        PyErr_Format(PyExc_TypeError, "%s: a tuple is needed, not %R", what, object);
    return PyTuple_Check(object);
}

int vkb_read_uint32(PyObject *object, void *number)
{
    const unsigned long long wide =
        PyLong_Check(object) ? PyLong_AsUnsignedLongLong(object) : (unsigned long long)-1;

    if (wide <= UINT32_MAX) {
        *(uint32_t *)number = (uint32_t)wide;
        return 1;
    }
    if (!PyLong_Check(object)) {
        PyErr_Format(PyExc_TypeError, "%R is not an integer", object);
        return 0;
    }
    PyErr_Clear();
    PyErr_Format(PyExc_ValueError, "%R is out of range, 0 to %u", object, UINT32_MAX);
    return 0;
}

bool vkb_set_item(PyObject *tuple, Py_ssize_t index, PyObject *item)
{
    return item && PyTuple_SetItem(tuple, index, item) == 0;
}

bool vkb_append_item(PyObject *list, PyObject *item)
{
    bool done = item && PyList_Append(list, item) == 0;
    Py_XDECREF(item);
    return done;
}

PyObject *vkb_image_names(const struct vkb_graph *graph, const uint32_t *images, uint32_t count)
{
    PyObject *tuple = PyTuple_New(count);

    for (uint32_t i = 0; tuple && i < count; ++i)
        if (!vkb_set_item(tuple, i, PyUnicode_FromString(graph->images[images[i]].name)))
            Py_CLEAR(tuple);
    return tuple;
}
