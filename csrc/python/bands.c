// Plans of parts of a graph, for images that are taken by bands of rows.
#include "python/module.h"
#include "python/plan.h"
#include "python/values.h"

#include <stdio.h>

bool vkb_read_names(PyObject *tuple, vkb_image_name *names, uint32_t *count)
{
    const Py_ssize_t given = PyTuple_Size(tuple);

    if (given > GATHERED_LEVELS) {
        PyErr_Format(PyExc_ValueError, "names: %zd names are out of range, 0 to %d", given,
                     GATHERED_LEVELS);
        return false;
    }
    for (*count = 0; *count < given; ++*count) {
        PyObject *text = PyUnicode_AsUTF8String(PyTuple_GetItem(tuple, *count));
        if (!text)
            return false;
        snprintf(names[*count], sizeof names[*count], "%s", PyBytes_AsString(text));
        Py_DECREF(text);
    }
    return true;
}

// (height, levels, first), where first is the place of the source's rows, or -1: without rows of
// it.
bool vkb_read_part(PyObject *tuple, const struct vkb_source_object *source, PyObject *names,
                   struct vkb_part *part)
{
    PyObject *levels;
    Py_ssize_t first;

    *part = (struct vkb_part){0};
    if (!vkb_require_tuple(tuple, "part") || !vkb_require_tuple(names, "names")
        || !PyArg_ParseTuple(tuple, "O&O!n:part", vkb_read_uint32, &part->height, &PyTuple_Type,
                             &levels, &first)
        || !vkb_read_names(names, part->outputs, &part->output_count)
        || !vkb_read_names(levels, part->levels, &part->level_count))
        return false;
    if (first < 0)
        return true;
    part->rows = source->source.image.size.height;
    if (part->rows > part->height || (uint64_t)first > part->height - part->rows) {
        PyErr_Format(PyExc_ValueError, "part: rows %zd to %zd are not within 0 to %u", first,
                     first + (Py_ssize_t)part->rows, part->height);
        return false;
    }
    part->first = (uint32_t)first;
    return true;
}

// The levels that the source brings must be what the graph has in their place.
static bool check_levels(const struct vkb_graph *graph, const struct vkb_source *source,
                         struct vkb_error *error)
{
    for (uint32_t i = 0; i < graph->image_count; ++i) {
        const struct vkb_image_row *row = &graph->images[i];
        if (row->input < VKB_INPUT_LEVEL)
            continue;
        const struct vkb_level *level = &source->image.levels[row->input - VKB_INPUT_LEVEL];
        if (level->format != row->format || level->size.width != row->width
            || level->size.height != row->height)
            return vkb_fail(error, VKB_ERROR_VALUE, "levels: %s is of another size or format",
                            row->name);
    }
    return true;
}

bool vkb_build_part(const struct vkb_source *source, const struct vkb_settings *settings,
                    const struct vkb_part *part, struct vkb_graph *graph, struct vkb_error *error)
{
    struct vkb_source whole = *source;

    if (source->kind != VKB_SOURCE_IMAGE)
        return vkb_fail(error, VKB_ERROR_VALUE, "part: only images have bands");
    whole.image.size.height = part->height;
    // A device that takes a band need not be able to take the complete image.
    return vkb_source_build(&whole, settings, VKB_MAX_SIDE, graph, error)
        && vkb_graph_take(graph, part, error) && check_levels(graph, source, error);
}

static PyObject *describe_bands(const struct vkb_graph *graph, const struct vkb_bands *bands)
{
    PyObject *levels = vkb_image_names(graph, bands->levels, bands->level_count);

    if (!levels)
        return NULL;
    const struct vkb_image_row *head =
        bands->head == VKB_NO_IMAGE ? NULL : &graph->images[bands->head];
    return Py_BuildValue("(zINII)", head ? head->name : NULL, head ? head->height : 0, levels,
                         bands->step, bands->reach);
}

PyObject *vkb_renderer_bands(PyObject *object, PyObject *arguments)
{
    const struct vkb_renderer *renderer = (const struct vkb_renderer *)object;
    const struct vkb_module_state *state = PyType_GetModuleState(Py_TYPE(object));
    PyObject *source, *settings_object;
    uint32_t height;
    struct vkb_settings settings;
    struct vkb_graph graph = {0};
    struct vkb_held_passes passes = {0};
    struct vkb_bands bands;
    struct vkb_error error = {0};

    if (!PyArg_ParseTuple(arguments, "O!OO&:bands", state->source_type, &source, &settings_object,
                          vkb_read_uint32, &height)
        || !vkb_read_settings(settings_object, &settings))
        return NULL;
    struct vkb_source complete = ((struct vkb_source_object *)source)->source;
    PyObject *result = NULL;
    if (complete.kind != VKB_SOURCE_IMAGE) {
        vkb_fail(&error, VKB_ERROR_VALUE, "bands: only images have bands");
        return vkb_raise(state, &error);
    }
    complete.image.size.height = height;
    if (vkb_hold_passes(state, settings_object, VKB_MAX_SIDE, &complete, &passes, &settings)) {
        graph.max_width = renderer->device.max_side;
        if (!vkb_require_open(renderer, &error)
            || !vkb_source_build(&complete, &settings, VKB_MAX_SIDE, &graph, &error))
            vkb_raise(state, &error);
        else if (vkb_graph_bands(&graph, vkb_graph_find(&graph, "final"), height, &bands))
            result = describe_bands(&graph, &bands);
        else
            result = Py_NewRef(Py_None);
    }
    vkb_graph_destroy(&graph);
    vkb_release_passes(&passes);
    return result;
}
