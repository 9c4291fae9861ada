// The kernels of convolutions and the picture of dirt, which are Python's arrays.
#include "python/arguments.h"

// (array (h, w, 4) of float32, of a grey kernel (h, w, 1), serial, (min, max, factor), (reach along
// x, along y))
static bool read_kernel_tuple(PyObject *tuple, Py_buffer *view, struct vkb_kernel_data *kernel)
{
    PyObject *pixels;
    unsigned long long serial;

    if (!vkb_require_tuple(tuple, "kernel")
        || !PyArg_ParseTuple(tuple, "OK(fff)(II):core_kernel", &pixels, &serial,
                             &kernel->prefilter[0], &kernel->prefilter[1], &kernel->prefilter[2],
                             &kernel->reach_x, &kernel->reach_y)
        || !vkb_hold_array(pixels, "kernel", VKB_FLOAT32, 0, view))
        return false;
    if (view->ndim != 3 || (view->shape[2] != 4 && view->shape[2] != 1) || view->len == 0)
        return vkb_refuse("kernel: an array with %d dimensions and %zd bytes is not (h, w, 4) or "
                          "(h, w, 1) with sides of at least 1",
                          view->ndim, view->len);
    // Images that are filled once have one; 0: the others.
    if (serial == 0)
        return vkb_refuse("kernel: the serial 0 is out of range, at least 1");
    kernel->serial = serial;
    kernel->pixels = view->buf;
    kernel->height = vkb_side(view->shape[0]);
    kernel->width = vkb_side(view->shape[1]);
    kernel->grey = view->shape[2] == 1;
    return true;
}

bool vkb_read_kernel_size(PyObject *object, struct vkb_size frame, struct vkb_size buffers,
                          struct vkb_kernel_data *kernel)
{
    PyObject *tuple = PyObject_CallMethod(object, "core_kernel_size", "(II)(II)", frame.width,
                                          frame.height, buffers.width, buffers.height);
    const bool done =
        tuple && vkb_require_tuple(tuple, "kernel size")
        && PyArg_ParseTuple(tuple, "II:core_kernel_size", &kernel->width, &kernel->height)
        && ((kernel->width && kernel->height)
            || vkb_refuse("kernel: a size of %u x %u is out of range, sides of at least 1",
                          kernel->width, kernel->height));

    Py_XDECREF(tuple);
    kernel->reach_x = kernel->width;
    kernel->reach_y = kernel->height;
    // No other kernel has this number, and the check of memory is for graphs with one.
    kernel->serial = UINT64_MAX;
    return done;
}

bool vkb_read_kernel(PyObject *object, struct vkb_size frame, struct vkb_size buffers,
                     Py_buffer *view, struct vkb_kernel_data *kernel)
{
    PyObject *tuple = PyObject_CallMethod(object, "core_kernel", "(II)(II)", frame.width,
                                          frame.height, buffers.width, buffers.height);
    const bool done = tuple && read_kernel_tuple(tuple, view, kernel);

    Py_XDECREF(tuple);
    return done;
}

bool vkb_find_kernel(PyObject *object, struct vkb_size frame, struct vkb_size buffers,
                     Py_buffer *view, struct vkb_kernel_data *kernel, bool *found)
{
    PyObject *tuple = PyObject_CallMethod(object, "kept_kernel", "(II)(II)", frame.width,
                                          frame.height, buffers.width, buffers.height);
    *found = tuple && tuple != Py_None;
    const bool done = tuple && (!*found || read_kernel_tuple(tuple, view, kernel));

    Py_XDECREF(tuple);
    return done;
}

// (kernels, those in a column of a grid, whether they gather, whether the first has no weights,
// columns and rows of the weights, weights and places as kernels)
static bool read_field_tuple(PyObject *tuple, struct vkb_size buffers, Py_buffer *weights,
                             Py_buffer *places, struct vkb_settings *settings)
{
    struct vkb_field *field = &settings->field;
    PyObject *of_weights, *of_places;

    if (!vkb_require_tuple(tuple, "field")
        || !PyArg_ParseTuple(tuple, "IIppIIOO:core_field", &field->count, &field->down,
                             &field->gathers, &field->first_unweighted, &field->columns,
                             &field->rows, &of_weights, &of_places)
        || !read_kernel_tuple(of_weights, weights, &field->weights)
        || !read_kernel_tuple(of_places, places, &field->places))
        return false;
    const uint64_t grids = field->columns ? field->weights.width / field->columns : 0;
    if (field->count > VKB_MAX_FIELD)
        return vkb_refuse("psf: a field of %u kernels is out of range, up to %d", field->count,
                          VKB_MAX_FIELD);
    if (!field->count || settings->kernel.height % field->count != 0)
        return vkb_refuse("field: %u kernels are not in %u rows", field->count,
                          settings->kernel.height);
    if (!field->down || field->count % field->down != 0)
        return vkb_refuse("field: %u kernels are not columns of %u", field->count, field->down);
    if (field->weights.grey || field->places.grey || !field->rows
        || 4 * grids * (field->weights.height / field->rows) < vkb_count_weights(field))
        return vkb_refuse(
            "field: %u x %u texels are not the weights of %u kernels at %u x %u places",
            field->weights.width, field->weights.height, field->count, field->columns, field->rows);
    if (field->places.width < buffers.width || field->places.width < buffers.height
        || field->places.width < field->columns || field->places.width < field->rows
        || field->places.width < 2 || field->places.height != 2)
        return vkb_refuse("field: %u x %u texels are not the places of %u columns and %u rows",
                          field->places.width, field->places.height, buffers.width, buffers.height);
    settings->kernel.height /= field->count;
    return true;
}

bool vkb_read_field(PyObject *object, struct vkb_size frame, struct vkb_size buffers,
                    Py_buffer *weights, Py_buffer *places, struct vkb_settings *settings)
{
    PyObject *tuple = PyObject_CallMethod(object, "core_field", "(II)(II)", frame.width,
                                          frame.height, buffers.width, buffers.height);
    const bool done =
        tuple && (tuple == Py_None || read_field_tuple(tuple, buffers, weights, places, settings));

    Py_XDECREF(tuple);
    return done;
}

bool vkb_read_exposure_mask(PyObject *object, Py_buffer *view, struct vkb_settings *settings)
{
    const struct vkb_size any = {0};
    PyObject *mask =
        settings->exposure_engine ? PyObject_GetAttrString(object, "meter_mask") : NULL;

    if (!settings->exposure_engine)
        return true;
    const bool done =
        mask
        && (mask == Py_None || vkb_read_kernel(mask, any, any, view, &settings->exposure_mask));
    Py_XDECREF(mask);
    return done;
}

bool vkb_read_dirt(PyObject *object, Py_buffer *view, struct vkb_settings *settings)
{
    const struct vkb_size any = {0};
    uint32_t i = 0;

    while (i < settings->stage_count && settings->stages[i].kind != VKB_STAGE_DIRT)
        ++i;
    if (i == settings->stage_count)
        return true;
    PyObject *tuple = PyObject_GetAttrString(object, "glare");
    PyObject *stage = tuple ? PySequence_GetItem(tuple, (Py_ssize_t)i) : NULL;
    const bool done = stage && vkb_read_kernel(stage, any, any, view, &settings->dirt);

    Py_XDECREF(stage);
    Py_XDECREF(tuple);
    return done;
}
