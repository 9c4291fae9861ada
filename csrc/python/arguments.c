// Python's settings as the core's struct. All functions return false with an exception set.
#include "python/arguments.h"
#include "python/values.h"

#include <float.h>
#include <math.h>
#include <string.h>

// The attributes of a settings object that are read here; the values' rows come last.
enum attribute {
    ATTRIBUTE_METHOD,
    ATTRIBUTE_THRESHOLD,
    ATTRIBUTE_FORMAT,
    ATTRIBUTE_BLOOM_SIZE,
    ATTRIBUTE_WEIGHTS,
    ATTRIBUTE_LAYERS,
    ATTRIBUTE_LEVEL_WEIGHTS,
    ATTRIBUTE_TINT,
    ATTRIBUTE_SUN_POSITION,
    ATTRIBUTE_CHOICES,
    ATTRIBUTE_VALUES = ATTRIBUTE_CHOICES + VKB_CHOICE_COUNT,
};

static const char *attribute_name(size_t attribute)
{
    static const char *const names[ATTRIBUTE_CHOICES] = {
        [ATTRIBUTE_METHOD] = "method",
        [ATTRIBUTE_THRESHOLD] = "threshold",
        [ATTRIBUTE_FORMAT] = "format",
        [ATTRIBUTE_BLOOM_SIZE] = "bloom_size",
        [ATTRIBUTE_WEIGHTS] = "weights",
        [ATTRIBUTE_LAYERS] = "layers",
        [ATTRIBUTE_LEVEL_WEIGHTS] = "level_weights",
        [ATTRIBUTE_TINT] = "tint",
        [ATTRIBUTE_SUN_POSITION] = "sun_position",
    };

    return attribute < ATTRIBUTE_CHOICES ? names[attribute]
         : attribute < ATTRIBUTE_VALUES  ? vkb_choice_rows[attribute - ATTRIBUTE_CHOICES].name
                                         : vkb_value_rows[attribute - ATTRIBUTE_VALUES].name;
}

bool vkb_make_attributes(struct vkb_module_state *state)
{
    const size_t count = ATTRIBUTE_VALUES + vkb_value_row_count;

    state->attributes = PyTuple_New((Py_ssize_t)count);
    for (size_t i = 0; state->attributes && i < count; ++i) {
        PyObject *name = PyUnicode_InternFromString(attribute_name(i));
        if (!name || PyTuple_SetItem(state->attributes, (Py_ssize_t)i, name) < 0)
            return false;
    }
    return state->attributes;
}

// A settings object that is being read.
struct reader {
    const struct vkb_module_state *state;
    PyObject *object;
    PyObject *fields;  // of a dataclass, by name; NULL: it is none
};

// The attribute, or NULL: without an exception where the object lacks it. One that its type has,
// such as a property, is not lacking, whatever reading it raises.
static PyObject *optional_attribute(const struct reader *reader, size_t attribute)
{
    PyObject *name = PyTuple_GetItem(reader->state->attributes, (Py_ssize_t)attribute);

    // An AttributeError takes ten times as long as this look-up, and most methods lack most fields.
    if (reader->fields && PyDict_Contains(reader->fields, name) == 0)
        return NULL;
    PyObject *value = PyObject_GetAttr(reader->object, name);
    if (value || !PyErr_ExceptionMatches(PyExc_AttributeError))
        return value;
    PyObject *type, *error, *traceback;
    PyErr_Fetch(&type, &error, &traceback);
    if (PyObject_HasAttr((PyObject *)Py_TYPE(reader->object), name)) {
        PyErr_Restore(type, error, traceback);
        return NULL;
    }
    Py_XDECREF(type);
    Py_XDECREF(error);
    Py_XDECREF(traceback);
    return NULL;
}

// None keeps the default.
static bool read_value(const struct reader *reader, size_t index, struct vkb_values *values)
{
    const struct vkb_value_row *row = &vkb_value_rows[index];
    PyObject *value = optional_attribute(reader, ATTRIBUTE_VALUES + index);

    vkb_value_store(values, row, row->initial);
    if (!value)
        return !PyErr_Occurred();
    const bool done = value == Py_None || vkb_read_number(value, row, values);
    Py_DECREF(value);
    return done;
}

static bool read_choice(const struct reader *reader, int index, int *choice)
{
    const struct vkb_choice_row *row = &vkb_choice_rows[index];
    PyObject *value = optional_attribute(reader, ATTRIBUTE_CHOICES + (size_t)index);

    *choice = 0;
    if (!value)
        return !PyErr_Occurred();
    *choice = vkb_read_name(value, row->spellings, row->count, row->name, "value");
    Py_DECREF(value);
    return *choice >= 0;
}

static bool read_format(const struct reader *reader, enum vkb_format *format)
{
    PyObject *value = optional_attribute(reader, ATTRIBUTE_FORMAT);

    *format = VKB_FORMAT_NONE;
    if (!value)
        return !PyErr_Occurred();
    if (value != Py_None) {
        PyObject *text = PyUnicode_Check(value) ? PyUnicode_AsUTF8String(value) : NULL;
        if (text)
            *format = vkb_format_by_name(PyBytes_AsString(text));
        Py_XDECREF(text);
        if (!PyErr_Occurred() && (*format == VKB_FORMAT_NONE || vkb_formats[*format].channels == 1))
            PyErr_Format(PyExc_ValueError, "format: %R is not a format of bloom buffers", value);
    }
    Py_DECREF(value);
    return !PyErr_Occurred();
}

static bool read_size(const struct reader *reader, struct vkb_settings *settings)
{
    PyObject *value = optional_attribute(reader, ATTRIBUTE_BLOOM_SIZE);
    bool done = true;

    if (!value)
        return !PyErr_Occurred();
    if (value != Py_None) {
        done = vkb_require_tuple(value, "bloom_size")
            && PyArg_ParseTuple(value, "O&O&;bloom_size must be (width, height)", vkb_read_uint32,
                                &settings->bloom_width, vkb_read_uint32, &settings->bloom_height);
        if (done && (settings->bloom_width == 0 || settings->bloom_height == 0)) {
            PyErr_Format(PyExc_ValueError, "bloom_size: %R is out of range, sides of at least 1",
                         value);
            done = false;
        }
    }
    Py_DECREF(value);
    return done;
}

static bool read_method(const struct reader *reader, enum vkb_method *method)
{
#define METHOD_NAME(constant, name, published) [VKB_METHOD_##constant] = #name,
    static const char *const names[VKB_METHOD_COUNT] = {VKB_METHODS(METHOD_NAME)};
#undef METHOD_NAME
    PyObject *value = PyObject_GetAttr(
        reader->object, PyTuple_GetItem(reader->state->attributes, ATTRIBUTE_METHOD));
    const int found =
        value ? vkb_read_name(value, names, VKB_METHOD_COUNT, "method", "method") : -1;

    Py_XDECREF(value);
    *method = (enum vkb_method)found;
    return found >= 0;
}

// From 1 to `most` numbers; None leaves them out.
static bool read_numbers(const struct reader *reader, size_t attribute, Py_ssize_t most,
                         float *numbers, uint32_t *number_count)
{
    PyObject *value = optional_attribute(reader, attribute);

    if (!value)
        return !PyErr_Occurred();
    if (value == Py_None) {
        Py_DECREF(value);
        return true;
    }
    Py_ssize_t count = PySequence_Size(value);
    if (count < 1 || count > most) {
        const char *name = attribute_name(attribute);
        if (!PyErr_Occurred())
            PyErr_Format(PyExc_ValueError, "%s: %zd weights are out of range, 1 to %zd", name,
                         count, most);
        Py_DECREF(value);
        return false;
    }
    for (Py_ssize_t i = 0; i < count && !PyErr_Occurred(); ++i) {
        PyObject *item = PySequence_GetItem(value, i);
        const double weight = item ? PyFloat_AsDouble(item) : 0.0;
        if (!PyErr_Occurred() && !(fabs(weight) <= FLT_MAX))
            vkb_out_of_range(attribute_name(attribute), item, -FLT_MAX, FLT_MAX);
        else
            numbers[i] = (float)weight;
        Py_XDECREF(item);
    }
    *number_count = (uint32_t)count;
    Py_DECREF(value);
    return !PyErr_Occurred();
}

// What a kernel's taps are found by must be neither negative nor NaN.
static bool is_layer_number(float number)
{
    return number >= 0.0f && number <= (float)LAYER_LIMIT;
}

static bool read_layers(const struct reader *reader, struct vkb_settings *settings)
{
    PyObject *value = optional_attribute(reader, ATTRIBUTE_LAYERS);

    if (!value)
        return !PyErr_Occurred();
    Py_ssize_t count = PySequence_Size(value);
    if (count < 1 || count > MAX_LAYERS) {
        if (!PyErr_Occurred())
            PyErr_Format(PyExc_ValueError, "layers: %zd layers are out of range, 1 to %d", count,
                         MAX_LAYERS);
        Py_DECREF(value);
        return false;
    }
    for (Py_ssize_t i = 0; i < count && !PyErr_Occurred(); ++i) {
        PyObject *item = PySequence_GetItem(value, i);
        struct vkb_layer *layer = &settings->layers[i];
        if (item && vkb_require_tuple(item, "layers")
            && PyArg_ParseTuple(item, "ff;layers must hold (scale, strength)", &layer->scale,
                                &layer->strength)
            && !(is_layer_number(layer->scale) && is_layer_number(layer->strength)))
            vkb_out_of_range("layers", item, 0.0, LAYER_LIMIT);
        Py_XDECREF(item);
    }
    settings->layer_count = (uint32_t)count;
    Py_DECREF(value);
    return !PyErr_Occurred();
}

// A separable blur has a kernel and a layer; whatever else the object lacks has a default.
static bool require_kernel(const struct vkb_settings *settings)
{
    if (settings->method != VKB_METHOD_SEPARABLE
        || (settings->weight_count > 0 && settings->layer_count > 0))
        return true;
    PyErr_Format(PyExc_ValueError, "%s: a separable blur needs them",
                 settings->weight_count ? "layers" : "weights");
    return false;
}

static bool read_all(const struct reader *reader, struct vkb_settings *settings)
{
    uint32_t count;

    memset(settings, 0, sizeof *settings);
    for (size_t i = 0; i < vkb_value_row_count; ++i)
        if (!read_value(reader, i, &settings->values))
            return false;
    for (int i = 0; i < VKB_CHOICE_COUNT; ++i)
        if (!read_choice(reader, i, &settings->choices[i]))
            return false;

    PyObject *threshold = optional_attribute(reader, ATTRIBUTE_THRESHOLD);
    settings->thresholded = threshold && threshold != Py_None;
    Py_XDECREF(threshold);
    return !PyErr_Occurred() && read_method(reader, &settings->method)
        && read_format(reader, &settings->format) && read_size(reader, settings)
        && read_numbers(reader, ATTRIBUTE_WEIGHTS, MAX_WEIGHTS, settings->weights,
                        &settings->weight_count)
        && read_layers(reader, settings)
        && read_numbers(reader, ATTRIBUTE_LEVEL_WEIGHTS, MAX_LEVELS, settings->level_weights,
                        &settings->level_weight_count)
        && read_numbers(reader, ATTRIBUTE_TINT, 3, settings->tint, &count)
        && read_numbers(reader, ATTRIBUTE_SUN_POSITION, 2, settings->sun_position, &count)
        && require_kernel(settings) && vkb_read_glare(reader->object, settings);
}

static bool read_fields(const struct vkb_module_state *state, PyObject *object,
                        struct vkb_settings *settings)
{
    PyObject *type = (PyObject *)Py_TYPE(object);
    struct reader reader = {.state = state, .object = object};

    if (PyObject_HasAttrString(type, "__dataclass_fields__")) {
        reader.fields = PyObject_GetAttrString(type, "__dataclass_fields__");
        if (!reader.fields)
            return false;
        if (!PyDict_Check(reader.fields))
            Py_CLEAR(reader.fields);
    }
    const bool done = read_all(&reader, settings);
    Py_XDECREF(reader.fields);
    return done;
}

bool vkb_read_settings(const struct vkb_module_state *state, PyObject *object,
                       struct vkb_settings *settings)
{
    static const char VIEW[] = "core_view";

    // Fields of a method that was loaded at run time may have the names of other methods' fields.
    if (!PyObject_HasAttrString((PyObject *)Py_TYPE(object), VIEW))
        return read_fields(state, object, settings);
    PyObject *view = PyObject_GetAttrString(object, VIEW);
    const bool done = view && read_fields(state, view, settings);
    Py_XDECREF(view);
    return done;
}
