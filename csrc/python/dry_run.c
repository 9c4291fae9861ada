// The passes that a sequence of plans would run, as names.
#include "graph/dry_run.h"

#include "python/module.h"
#include "python/plan.h"

// The names that the passes are timed under, without those that come again.
static PyObject *names_of(const struct vkb_graph *graph, const bool *ran)
{
    PyObject *names = PyDict_New();

    for (uint32_t first = 0; names && first < graph->pass_count; ++first)
        if (ran[first]
            && PyDict_SetItemString(names, vkb_graph_timed_as(graph, first), Py_None) < 0)
            Py_CLEAR(names);
    PyObject *list = names ? PyDict_Keys(names) : NULL;
    Py_XDECREF(names);
    return list;
}

// Scenes know each other by their serials, whatever the frame's time is; images are compared by
// their pixels when they come to the device, and here taken for different ones.
static uint64_t source_number(PyObject *object)
{
    const struct vkb_source_object *source = (const struct vkb_source_object *)object;

    return source->source.kind == VKB_SOURCE_SCENE ? source->scene.data.serial
                                                   : (uint64_t)(uintptr_t)source;
}

static PyObject *dry_step(const struct vkb_module_state *state, struct vkb_dry_run *dry_run,
                          PyObject *step)
{
    PyObject *source, *object;
    struct vkb_error error = {0};

    if (!PyArg_ParseTuple(step, "O!O!:dry_run", state->source_type, &source, state->plan_type,
                          &object))
        return NULL;
    const struct vkb_plan *plan = &((struct vkb_plan_object *)object)->plan;
    bool *ran = vkb_alloc(&error, plan->graph.pass_count, sizeof *ran);
    PyObject *names = ran && vkb_dry_run_step(dry_run, plan, source_number(source), ran, &error)
                        ? names_of(&plan->graph, ran)
                        : vkb_raise(state, &error);
    vkb_free(ran);
    return names;
}

PyObject *vkb_dry_run_names(PyObject *module, PyObject *steps)
{
    struct vkb_dry_run dry_run = {0};

    PyObject *list = PyList_New(0);
    for (Py_ssize_t i = 0, count = PyTuple_Size(steps); list && i < count; ++i)
        if (!vkb_append_item(
                list, dry_step(vkb_module_state(module), &dry_run, PyTuple_GetItem(steps, i))))
            Py_CLEAR(list);
    vkb_dry_run_destroy(&dry_run);
    return list;
}
