// The stages of glare of a settings object.
#include "python/arguments.h"
#include "python/values.h"

// A missing number has its default.
static bool read_number(PyObject *object, const struct vkb_value_row *row,
                        struct vkb_glare_values *values)
{
    vkb_value_store(values, row, row->initial);
    if (!PyObject_HasAttrString(object, row->name))
        return true;
    PyObject *value = PyObject_GetAttrString(object, row->name);
    const bool done = value && vkb_read_number(value, row, values);
    Py_XDECREF(value);
    return done;
}

static bool read_kind(PyObject *object, enum vkb_stage_kind *kind)
{
#define STAGE_NAME(constant, name) [VKB_STAGE_##constant] = #name,
    static const char *const names[VKB_STAGE_COUNT] = {VKB_STAGES(STAGE_NAME)};
#undef STAGE_NAME
    PyObject *value = PyObject_GetAttrString(object, "stage");
    const int found = value ? vkb_read_name(value, names, VKB_STAGE_COUNT, "glare", "stage") : -1;

    Py_XDECREF(value);
    *kind = (enum vkb_stage_kind)found;
    return found >= 0;
}

static bool is_within(float number, double limit)
{
    return number >= -limit && number <= limit;
}

// A ghost: (scale, (red, green, blue)).
static bool read_ghost(PyObject *tuple, float ghost[4])
{
    if (!vkb_require_tuple(tuple, "ghosts")
        || !PyArg_ParseTuple(tuple, "f(fff);ghosts must hold (scale, (red, green, blue))",
                             &ghost[3], &ghost[0], &ghost[1], &ghost[2]))
        return false;
    for (int i = 0; i < 4; ++i)
        if (!is_within(ghost[i], i == 3 ? GHOST_LIMIT : HALF_LIMIT))
            return vkb_out_of_range("ghosts", tuple, -GHOST_LIMIT, GHOST_LIMIT);
    return true;
}

// The length of a tuple of at most `most` items; -1 with an exception set.
static Py_ssize_t tuple_length(PyObject *tuple, const char *name, const char *items,
                               Py_ssize_t most)
{
    if (!vkb_require_tuple(tuple, name))
        return -1;
    const Py_ssize_t count = PyTuple_Size(tuple);
    if (count <= most)
        return count;
    PyErr_Format(PyExc_ValueError, "%s: %zd %s are out of range, 0 to %zd", name, count, items,
                 most);
    return -1;
}

static bool read_ghost_tuple(PyObject *tuple, struct vkb_stage *stage)
{
    const Py_ssize_t count = tuple_length(tuple, "ghosts", "ghosts", MAX_GHOSTS);

    if (count < 0)
        return false;
    for (Py_ssize_t i = 0; i < count; ++i)
        if (!read_ghost(PyTuple_GetItem(tuple, i), stage->ghosts[i]))
            return false;
    stage->ghost_count = (uint32_t)count;
    return true;
}

static bool read_ghosts(PyObject *object, struct vkb_stage *stage)
{
    PyObject *tuple = PyObject_GetAttrString(object, "ghosts");
    const bool done = tuple && read_ghost_tuple(tuple, stage);

    Py_XDECREF(tuple);
    return done;
}

static bool read_stage(PyObject *object, struct vkb_stage *stage)
{
    for (size_t i = 0; i < vkb_glare_row_count; ++i)
        if (!read_number(object, &vkb_glare_rows[i], &stage->values))
            return false;
    return read_kind(object, &stage->kind)
        && (stage->kind != VKB_STAGE_GHOSTS || read_ghosts(object, stage));
}

static bool read_stages(PyObject *tuple, struct vkb_settings *settings)
{
    const Py_ssize_t count = tuple_length(tuple, "glare", "stages", MAX_STAGES);

    if (count < 0)
        return false;
    for (Py_ssize_t i = 0; i < count; ++i)
        if (!read_stage(PyTuple_GetItem(tuple, i), &settings->stages[i]))
            return false;
    settings->stage_count = (uint32_t)count;
    return true;
}

bool vkb_read_glare(PyObject *object, struct vkb_settings *settings)
{
    if (!PyObject_HasAttrString(object, "glare"))
        return true;
    PyObject *tuple = PyObject_GetAttrString(object, "glare");
    const bool done = tuple && read_stages(tuple, settings);
    Py_XDECREF(tuple);
    return done;
}

bool vkb_read_dirt(PyObject *object, struct vkb_held_kernel *held, struct vkb_settings *settings)
{
    const struct vkb_size any = {0};
    bool done = true;

    for (uint32_t i = 0; done && i < settings->stage_count; ++i) {
        if (settings->stages[i].kind != VKB_STAGE_DIRT)
            continue;
        if (held->held) {
            PyErr_SetString(PyExc_ValueError, "glare: there is more than one stage dirt");
            return false;
        }
        PyObject *tuple = PyObject_GetAttrString(object, "glare");
        PyObject *stage = tuple ? PySequence_GetItem(tuple, (Py_ssize_t)i) : NULL;
        done = stage && vkb_read_kernel(stage, any, any, held, &settings->dirt);
        Py_XDECREF(stage);
        Py_XDECREF(tuple);
    }
    return done;
}
