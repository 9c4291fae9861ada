// Settings as Python packs them: the members of struct vkb_settings before its pointers, by the
// tables that this file gives. All functions return false with an exception set.
#include "python/arguments.h"

#include <stddef.h>
#include <string.h>

enum { BLOCK_SIZE = offsetof(struct vkb_settings, kernel) };

// A member that no table of numbers has: the code of its elements in NumPy, whose last character is
// their size, and their number.
struct member {
    const char *name, *code;
    size_t offset, size;
};

#define MEMBER(of, name, code) {#name, code, offsetof(struct of, name), sizeof((struct of){0}.name)}

static const struct member settings_members[] = {
    MEMBER(vkb_settings, method, "i4"),
    MEMBER(vkb_settings, thresholded, "i4"),
    MEMBER(vkb_settings, bloom_width, "u4"),
    MEMBER(vkb_settings, bloom_height, "u4"),
    MEMBER(vkb_settings, format, "i4"),
    MEMBER(vkb_settings, weights, "f4"),
    MEMBER(vkb_settings, weight_count, "u4"),
    MEMBER(vkb_settings, layers, "f4"),
    MEMBER(vkb_settings, layer_count, "u4"),
    MEMBER(vkb_settings, level_weights, "f4"),
    MEMBER(vkb_settings, level_weight_count, "u4"),
    MEMBER(vkb_settings, tint, "f4"),
    MEMBER(vkb_settings, sun_position, "f4"),
    // Structs, which the other table describes.
    MEMBER(vkb_settings, stages, ""),
    MEMBER(vkb_settings, stage_count, "u4"),
    {"", "", 0, BLOCK_SIZE},
};

static const struct member stage_members[] = {
    MEMBER(vkb_stage, kind, "i4"),
    MEMBER(vkb_stage, ghosts, "f4"),
    MEMBER(vkb_stage, ghost_count, "u4"),
    {"", "", 0, sizeof(struct vkb_stage)},
};

static bool add_member(PyObject *table, const struct member *member)
{
    const size_t size = *member->code ? (size_t)(member->code[1] - '0') : 1;
    return vkb_set_entry(table, member->name,
                         Py_BuildValue("(nsn)", (Py_ssize_t)member->offset, member->code,
                                       (Py_ssize_t)(member->size / size)));
}

// {name: (offset, code, number of elements)}; under "" the size of the struct.
static PyObject *block_table(const struct member *members, size_t count,
                             const struct vkb_value_row *rows, size_t row_count, size_t offset)
{
    PyObject *table = PyDict_New();
    bool done = table;

    for (size_t i = 0; done && i < count; ++i)
        done = add_member(table, &members[i]);
    for (size_t i = 0; done && i < row_count; ++i) {
        static const char *const codes[] = {
            [VKB_VALUE_FLOAT] = "f4", [VKB_VALUE_INT] = "i4", [VKB_VALUE_DOUBLE] = "f8"};
        const char *code = codes[rows[i].type];
        done = add_member(table, &(struct member){rows[i].name, code, offset + rows[i].offset,
                                                  (size_t)(code[1] - '0')});
    }
    if (!done)
        Py_CLEAR(table);
    return table;
}

PyObject *vkb_stage_block_table(void)
{
    return block_table(stage_members, sizeof stage_members / sizeof stage_members[0],
                       vkb_glare_rows, vkb_glare_row_count, offsetof(struct vkb_stage, values));
}

PyObject *vkb_settings_block_table(void)
{
    PyObject *table =
        block_table(settings_members, sizeof settings_members / sizeof settings_members[0],
                    vkb_value_rows, vkb_value_row_count, offsetof(struct vkb_settings, values));

    for (size_t i = 0; table && i < VKB_CHOICE_COUNT; ++i) {
        const struct member member = {vkb_choice_rows[i].name, "i4",
                                      offsetof(struct vkb_settings, choices) + i * sizeof(int),
                                      sizeof(int)};
        if (!add_member(table, &member))
            Py_CLEAR(table);
    }
    return table;
}

bool vkb_read_settings(PyObject *object, struct vkb_settings *settings)
{
    PyObject *block = PyObject_CallMethod(object, "_core_block", NULL);
    const bool done = block && PyBytes_Check(block) && PyBytes_Size(block) == BLOCK_SIZE;

    if (block && !done)
        PyErr_Format(PyExc_TypeError, "settings: a block of %d bytes is needed, not %R",
                     (int)BLOCK_SIZE, block);
    memset(settings, 0, sizeof *settings);
    if (done)
        memcpy(settings, PyBytes_AsString(block), BLOCK_SIZE);
    Py_XDECREF(block);
    return done;
}
