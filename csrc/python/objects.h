// What all types share: the module's state, objects and exceptions. The only header of the core
// that includes Python.h.
#ifndef VKB_PYTHON_OBJECTS_H
#define VKB_PYTHON_OBJECTS_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include "vulkan/adapter.h"

struct vkb_module_state {
    PyObject *renderer_type, *source_type, *contents_type, *plan_type, *submission_type,
        *pages_type, *exported_type;
    // What the package gives the module when it is imported (connect). Exception classes by enum
    // vkb_error_kind, RuntimeError until then; a function that says which name may be meant.
    PyObject *errors[VKB_ERROR_VALUE + 1];
    PyObject *describe_unknown;
};

struct vkb_module_state *vkb_module_state(PyObject *module);

// Creates an object of a heap type with zeroed members. NULL with an exception set.
void *vkb_new_object(PyObject *type);
// Frees an object whose members have been released, and releases its type: the end of tp_dealloc.
void vkb_free_object(PyObject *object);
// tp_dealloc of the types whose tp_clear releases all members.
void vkb_dealloc(PyObject *object);

// Python cannot create objects of types with these flags.
#define VKB_TYPE_FLAGS \
    (Py_TPFLAGS_DEFAULT | Py_TPFLAGS_IMMUTABLETYPE | Py_TPFLAGS_DISALLOW_INSTANTIATION)

// Sets an item of a new tuple, whose reference the tuple gets; false if it is NULL.
bool vkb_set_item(PyObject *tuple, Py_ssize_t index, PyObject *item);
// Sets an entry of a dictionary and releases it; false if it is NULL.
bool vkb_set_entry(PyObject *dict, const char *name, PyObject *entry);
// Appends an item to a list and releases it; false if it is NULL.
bool vkb_append_item(PyObject *list, PyObject *item);

// Sets a ValueError whose text is formatted as that of vkb_fail. Returns false.
bool vkb_refuse(const char *format, ...);
// Whether the object is a tuple, or an object of that type; else a TypeError is set that begins
// with the name.
bool vkb_require_tuple(PyObject *object, const char *name);
bool vkb_require_type(PyObject *object, PyObject *type, const char *name);
// Whether there is at least one byte; else a ValueError is set.
bool vkb_check_bytes(const char *name, Py_ssize_t size);

// Raises the exception class of the error; returns NULL.
PyObject *vkb_raise(const struct vkb_module_state *state, const struct vkb_error *error);

// (name, type, driver, driver_info, api_version, driver UUID as bytes, bundled, UUID, PCI address)
PyObject *vkb_adapter_tuple(const struct vkb_adapter_info *adapter);

#endif
