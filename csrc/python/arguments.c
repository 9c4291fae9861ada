// Settings as Python packs them: the members of struct vkb_settings before its pointers, by the
// tables that this file gives. What Python's classes check is checked here again, as far as a graph
// could not be built of it: other callers may give any bytes. All functions return false with an
// exception set.
#include "python/arguments.h"

#include <math.h>
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
    MEMBER(vkb_settings, stage_threshold, "f4"),
    MEMBER(vkb_settings, stage_threshold_count, "u4"),
    MEMBER(vkb_settings, bloom_width, "u4"),
    MEMBER(vkb_settings, bloom_height, "u4"),
    MEMBER(vkb_settings, format, "i4"),
    MEMBER(vkb_settings, weights, "f4"),
    MEMBER(vkb_settings, weight_count, "u4"),
    MEMBER(vkb_settings, layers, "f8"),
    MEMBER(vkb_settings, layer_count, "u4"),
    MEMBER(vkb_settings, level_weights, "f4"),
    MEMBER(vkb_settings, level_weight_count, "u4"),
    MEMBER(vkb_settings, tint, "f4"),
    MEMBER(vkb_settings, sun_position, "f4"),
    MEMBER(vkb_settings, gaussian_sizes, "f8"),
    MEMBER(vkb_settings, gaussian_tints, "f8"),
    // Structs, which the other table describes.
    MEMBER(vkb_settings, stages, ""),
    MEMBER(vkb_settings, stage_count, "u4"),
    MEMBER(vkb_settings, exposure_engine, "u4"),
    MEMBER(vkb_settings, exposure_numbers, "f4"),
    MEMBER(vkb_settings, exposure_table, "f4"),
    MEMBER(vkb_settings, exposure_key_count, "u4"),
    MEMBER(vkb_settings, taa_engine, "u4"),
    MEMBER(vkb_settings, taa_after, "u4"),
    MEMBER(vkb_settings, taa_numbers, "f4"),
    MEMBER(vkb_settings, taa_weights, "f4"),
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

// Numbers in the ranges of their rows. A default may be outside, where it stands for no limit.
static bool check_values(const struct vkb_value_row *rows, size_t count, const void *values)
{
    for (const struct vkb_value_row *row = rows; row < rows + count; ++row) {
        const void *at = (const char *)values + row->offset;
        const bool single = row->type == VKB_VALUE_FLOAT;
        const double low = single ? (float)row->low : row->low;
        const double high = single ? (float)row->high : row->high;
        const double initial = single ? (float)row->initial : row->initial;
        double value;

        if (single)
            value = *(const float *)at;
        else
            value = row->type == VKB_VALUE_INT ? *(const int *)at : *(const double *)at;
        if (!(value >= low && value <= high) && value != initial)
            return vkb_refuse("%s: %g is out of range, %g to %g", row->name, value, row->low,
                              row->high);
    }
    return true;
}

#define CHECK_FINITE_FUNCTION(function, type) \
    static bool function(const char *name, const type *numbers, size_t count) \
    { \
        for (size_t i = 0; i < count; ++i) \
            if (!isfinite(numbers[i])) \
                return vkb_refuse("%s: %g is out of range, finite numbers", name, numbers[i]); \
        return true; \
    }

CHECK_FINITE_FUNCTION(check_finite, float)
CHECK_FINITE_FUNCTION(check_finite_doubles, double)

static bool check_count(const char *name, uint32_t count, uint32_t least, uint32_t most)
{
    return (count >= least && count <= most)
        || vkb_refuse("%s: %u are out of range, %u to %u", name, count, least, most);
}

static bool check_choices(const struct vkb_settings *settings)
{
    for (size_t i = 0; i < VKB_CHOICE_COUNT; ++i) {
        const struct vkb_choice_row *row = &vkb_choice_rows[i];
        if (settings->choices[i] < 0 || settings->choices[i] >= row->count)
            return vkb_refuse("%s: %d is out of range, 0 to %d", row->name, settings->choices[i],
                              row->count - 1);
    }
    if ((unsigned)settings->method >= VKB_METHOD_COUNT)
        return vkb_refuse("method: %d is out of range, 0 to %d", (int)settings->method,
                          VKB_METHOD_COUNT - 1);
    // Those of buffers come before those of masks and depths.
    if ((unsigned)settings->format >= VKB_FORMAT_R32_FLOAT)
        return vkb_refuse("format: %d is out of range, 0 to %d", (int)settings->format,
                          VKB_FORMAT_R32_FLOAT - 1);
    return true;
}

static bool check_stages(const struct vkb_settings *settings)
{
    if (!check_count("glare", settings->stage_count, 0, MAX_STAGES))
        return false;
    for (uint32_t i = 0; i < settings->stage_count; ++i) {
        const struct vkb_stage *stage = &settings->stages[i];
        if ((unsigned)stage->kind >= VKB_STAGE_COUNT)
            return vkb_refuse("glare: the stage %d is out of range, 0 to %d", (int)stage->kind,
                              VKB_STAGE_COUNT - 1);
        if (!check_count("ghosts", stage->ghost_count, 0, MAX_GHOSTS)
            || !check_finite("ghosts", stage->ghosts[0], 4 * stage->ghost_count)
            || !check_values(vkb_glare_rows, vkb_glare_row_count, &stage->values))
            return false;
    }
    return true;
}

static bool check_exposure(const struct vkb_settings *settings)
{
    return check_count("exposure_engine", settings->exposure_engine, 0, VKB_EXPOSURE_END - 1)
        && check_finite("exposure_numbers", settings->exposure_numbers, VKB_EXPOSURE_NUMBERS)
        && check_finite("exposure_table", settings->exposure_table, EXPOSURE_TABLE)
        && check_count("exposure_key_count", settings->exposure_key_count, 0, EXPOSURE_TABLE / 2);
}

static bool check_taa(const struct vkb_settings *settings)
{
    // The last of the numbers.
    const float phases = settings->taa_numbers[VKB_TAA_NUMBERS - 1];

    return check_count("taa_engine", settings->taa_engine, 0, VKB_TAA_END - 1)
        && check_count("taa_after", settings->taa_after, 0, 1)
        && check_finite("taa_numbers", settings->taa_numbers, VKB_TAA_NUMBERS)
        && check_finite("taa_weights", settings->taa_weights[0],
                        sizeof settings->taa_weights / sizeof(float))
        && (!settings->taa_engine || (phases >= 1.0f && phases <= TAA_PHASES)
            || vkb_refuse("phases: %g is out of range, 1 to %d", phases, TAA_PHASES));
}

static bool check_settings(const struct vkb_settings *settings)
{
    return check_choices(settings)
        && check_values(vkb_value_rows, vkb_value_row_count, &settings->values)
        && check_count("weights", settings->weight_count, vkb_method_of(settings)->min_weights,
                       MAX_WEIGHTS)
        && check_finite("weights", settings->weights, settings->weight_count)
        && check_count("layers", settings->layer_count, vkb_method_of(settings)->min_layers,
                       MAX_LAYERS)
        && check_finite_doubles("layers", &settings->layers[0].scale, 2 * settings->layer_count)
        && check_count("level_weights", settings->level_weight_count, 0, MAX_LEVELS)
        && check_finite("level_weights", settings->level_weights, settings->level_weight_count)
        && check_finite("tint", settings->tint, 3)
        && check_finite("sun_position", settings->sun_position, 2)
        && check_finite_doubles("gaussian_sizes", settings->gaussian_sizes, MAX_GAUSSIANS)
        && check_finite_doubles("gaussian_tints", settings->gaussian_tints, MAX_GAUSSIANS)
        && check_stages(settings) && check_exposure(settings) && check_taa(settings);
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
    return done && check_settings(settings);
}
