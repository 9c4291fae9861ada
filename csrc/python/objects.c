// What all types share: objects, the state of the module, the exceptions of errors.
#include "python/objects.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

struct vkb_module_state *vkb_module_state(PyObject *module)
{
    return PyModule_GetState(module);
}

PyObject *vkb_raise(const struct vkb_module_state *state, const struct vkb_error *error)
{
    // The exception of what interrupted is there already.
    if (error->kind == VKB_ERROR_INTERRUPTED)
        return NULL;
    PyObject *type = state->errors[error->kind];
    // Where a long message is cut, a character may be, too.
    PyObject *message =
        PyUnicode_DecodeUTF8(error->message, (Py_ssize_t)strlen(error->message), "replace");
    PyObject *exception =
        message && *error->call
            ? PyObject_CallFunction(type, "Osi", message, error->call, (int)error->result)
            : Py_XNewRef(message);

    if (exception)
        PyErr_SetObject(type, exception);
    Py_XDECREF(exception);
    Py_XDECREF(message);
    return NULL;
}

PyObject *vkb_adapter_tuple(const struct vkb_adapter_info *adapter)
{
    char uuid[VKB_UUID_TEXT_SIZE];

    vkb_uuid_text(adapter->uuid, uuid);
    return Py_BuildValue("(ssssNy#NssIN)", adapter->name, vkb_adapter_type(adapter),
                         adapter->driver, adapter->driver_info,
                         PyUnicode_FromFormat("%u.%u.%u",
                                              VK_API_VERSION_MAJOR(adapter->api_version),
                                              VK_API_VERSION_MINOR(adapter->api_version),
                                              VK_API_VERSION_PATCH(adapter->api_version)),
                         (const char *)adapter->driver_uuid, (Py_ssize_t)VK_UUID_SIZE,
                         PyBool_FromLong(adapter->bundled), uuid, adapter->pci, adapter->vendor,
                         PyBool_FromLong(!adapter->nonconformant));
}

bool vkb_set_item(PyObject *tuple, Py_ssize_t index, PyObject *item)
{
    return item && PyTuple_SetItem(tuple, index, item) == 0;
}

bool vkb_set_entry(PyObject *dict, const char *name, PyObject *entry)
{
    const bool done = entry && PyDict_SetItemString(dict, name, entry) == 0;
    Py_XDECREF(entry);
    return done;
}

bool vkb_append_item(PyObject *list, PyObject *item)
{
    const bool done = item && PyList_Append(list, item) == 0;

    Py_XDECREF(item);
    return done;
}

bool vkb_refuse(const char *format, ...)
{
    char text[512];
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    PyErr_SetString(PyExc_ValueError, text);
    return false;
}

bool vkb_require_tuple(PyObject *object, const char *name)
{
    if (PyTuple_Check(object))
        return true;
    PyErr_Format(PyExc_TypeError, "%s: %R is not a tuple", name, object);
    return false;
}

bool vkb_require_type(PyObject *object, PyObject *type, const char *name)
{
    if (PyObject_TypeCheck(object, (PyTypeObject *)type))
        return true;
    PyErr_Format(PyExc_TypeError, "%s: %R is not a %R", name, object, type);
    return false;
}

bool vkb_check_bytes(const char *name, Py_ssize_t size)
{
    return size > 0 || vkb_refuse("%s: %zd bytes are out of range, at least 1", name, size);
}

void *vkb_new_object(PyObject *type)
{
    const allocfunc allocate = (allocfunc)PyType_GetSlot((PyTypeObject *)type, Py_tp_alloc);

    return allocate((PyTypeObject *)type, 0);
}

void vkb_free_object(PyObject *object)
{
    PyTypeObject *type = Py_TYPE(object);
    const freefunc release = (freefunc)PyType_GetSlot(type, Py_tp_free);

    release(object);
    Py_DECREF(type);
}

void vkb_dealloc(PyObject *object)
{
    const inquiry clear = (inquiry)PyType_GetSlot(Py_TYPE(object), Py_tp_clear);

    PyObject_GC_UnTrack(object);
    clear(object);
    vkb_free_object(object);
}
