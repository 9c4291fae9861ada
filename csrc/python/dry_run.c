// The passes that a sequence of plans would run.

#include "python/module.h"
#include "python/plan.h"

// Scenes know each other by their serials, whatever the frame's time is; images are compared by
// their pixels when they come to the device, and here taken for different ones.
static uint64_t source_number(PyObject *object)
{
    const struct vkb_source_object *source = (const struct vkb_source_object *)object;

    return source->source.kind == VKB_SOURCE_SCENE ? source->contents->data.serial
                                                   : (uint64_t)(uintptr_t)source;
}

static PyObject *dry_step(const struct vkb_module_state *state, struct vkb_dry_run *dry_run,
                          PyObject *step)
{
    PyObject *source, *plan;

    if (!vkb_require_tuple(step, "dry_run"))
        return NULL;
    if (!PyArg_ParseTuple(step, "O!O!:dry_run", state->source_type, &source, state->plan_type,
                          &plan))
        return NULL;
    return vkb_passes_that_run(state, dry_run, &((struct vkb_plan_object *)plan)->plan,
                               source_number(source));
}

PyObject *vkb_dry_run_steps(PyObject *module, PyObject *steps)
{
    struct vkb_dry_run dry_run = {0};

    if (!vkb_require_tuple(steps, "dry_run"))
        return NULL;
    PyObject *list = PyList_New(0);
    for (Py_ssize_t i = 0, count = PyTuple_Size(steps); list && i < count; ++i)
        if (!vkb_append_item(
                list, dry_step(vkb_module_state(module), &dry_run, PyTuple_GetItem(steps, i))))
            Py_CLEAR(list);
    vkb_dry_run_destroy(&dry_run);
    return list;
}
