// Plans of derivatives.
#include "methods/adjoint.h"

#include "python/module.h"
#include "python/plan.h"

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
        || !vkb_read_settings(settings_object, &settings)
        || !vkb_read_names(names, cotangents.names, &cotangents.count))
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
