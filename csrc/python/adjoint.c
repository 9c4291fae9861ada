// Plans of derivatives.
#include "methods/adjoint.h"

#include "python/module.h"
#include "python/plan.h"

#include <stdio.h>

static bool read_names(PyObject *tuple, struct vkb_cotangents *cotangents)
{
    const Py_ssize_t given = PyTuple_Size(tuple);

    if (given > GATHERED_LEVELS) {
        PyErr_Format(PyExc_ValueError, "names: %zd names are out of range, 0 to %d", given,
                     GATHERED_LEVELS);
        return false;
    }
    for (cotangents->count = 0; cotangents->count < given; ++cotangents->count) {
        PyObject *text = PyUnicode_AsUTF8String(PyTuple_GetItem(tuple, cotangents->count));
        if (!text)
            return false;
        snprintf(cotangents->names[cotangents->count], VKB_NAME_SIZE, "%s", PyBytes_AsString(text));
        Py_DECREF(text);
    }
    return true;
}

PyObject *vkb_renderer_adjoint(PyObject *object, PyObject *arguments)
{
    const struct vkb_renderer *renderer = (const struct vkb_renderer *)object;
    const struct vkb_module_state *state = PyType_GetModuleState(Py_TYPE(object));
    PyObject *source, *settings_object, *names;
    struct vkb_cotangents cotangents;
    struct vkb_portion portion = {.cotangents = &cotangents};
    struct vkb_settings settings;
    struct vkb_error error = {0};
    int sums;

    if (!PyArg_ParseTuple(arguments, "O!OO!p:adjoint", state->source_type, &source,
                          &settings_object, &PyTuple_Type, &names, &sums)
        || !vkb_read_settings(settings_object, &settings) || !read_names(names, &cotangents))
        return NULL;
    cotangents.sums = sums;
    if (!vkb_require_open(renderer, &error))
        return vkb_raise(state, &error);
    if (!vkb_check_source(renderer, (struct vkb_source_object *)source))
        return NULL;
    PyObject *plan = vkb_new_plan(state, &renderer->device, renderer->variants, renderer->serial,
                                  source, settings_object, &settings, &portion, Py_None);
    if (!plan || portion.is_possible)
        return plan;
    Py_DECREF(plan);
    Py_RETURN_NONE;
}
