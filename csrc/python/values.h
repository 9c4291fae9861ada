// Single numbers, names and tuples.
#ifndef VKB_PYTHON_VALUES_H
#define VKB_PYTHON_VALUES_H

#include "python/objects.h"

#include "graph/graph.h"
#include "graph/params.h"

// Whether the object is a tuple, which PyArg_ParseTuple requires; otherwise sets a TypeError.
bool vkb_require_tuple(PyObject *object, const char *what);

// Converters for PyArg_ParseTuple ("O&"): its own codes for unsigned integers accept any number
// modulo 2^32. 0 with an exception set.
int vkb_read_uint32(PyObject *object, void *number);

// The buffer protocol's code of the element type; 0 if it is not a single number in this machine's
// byte order, whether or not the format names the order.
char vkb_element_code(const Py_buffer *view);
bool vkb_has_element(const Py_buffer *view, const char *codes);

// The format of pixels whose channels have the element type B, e or f.
enum vkb_format vkb_pixel_format(char code);

// Sets an item of a new tuple, whose reference the tuple gets; false if it is NULL.
bool vkb_set_item(PyObject *tuple, Py_ssize_t index, PyObject *item);

// Appends an item to a list and releases it; false if it is NULL.
bool vkb_append_item(PyObject *list, PyObject *item);

// A tuple of the names of images.
PyObject *vkb_image_names(const struct vkb_graph *graph, const uint32_t *images, uint32_t count);

#endif
