// The kernels of convolutions and the picture of dirt, which are Python's arrays.
#include "python/arguments.h"
#include "python/values.h"

// (pixels, serial, whether it is grey, (min, max, factor))
static bool read_kernel_tuple(PyObject *tuple, struct vkb_held_kernel *held,
                              struct vkb_kernel_data *kernel)
{
    PyObject *pixels;
    unsigned long long serial;
    int grey;

    if (!vkb_require_tuple(tuple, "core_kernel")
        || !PyArg_ParseTuple(
            tuple, "OKp(fff);core_kernel must be (pixels, serial, grey, prefilter)", &pixels,
            &serial, &grey, &kernel->prefilter[0], &kernel->prefilter[1], &kernel->prefilter[2])
        || PyObject_GetBuffer(pixels, &held->view, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) < 0)
        return false;
    held->held = true;
    kernel->serial = serial;
    if (!vkb_has_element(&held->view, "f") || held->view.ndim != 3 || held->view.shape[2] != 4
        || held->view.shape[0] < 1 || held->view.shape[0] > VKB_MAX_SIDE || held->view.shape[1] < 1
        || held->view.shape[1] > VKB_MAX_SIDE) {
        PyErr_Format(PyExc_ValueError,
                     "kernel: an array (h, w, 4) of float32 with sides of 1 to %d is needed",
                     VKB_MAX_SIDE);
        return false;
    }
    kernel->pixels = held->view.buf;
    kernel->height = (uint32_t)held->view.shape[0];
    kernel->width = (uint32_t)held->view.shape[1];
    kernel->grey = grey;
    return true;
}

bool vkb_read_kernel_size(PyObject *object, struct vkb_size frame, struct vkb_size buffers,
                          struct vkb_kernel_data *kernel)
{
    PyObject *tuple = PyObject_CallMethod(object, "core_kernel_size", "(II)(II)", frame.width,
                                          frame.height, buffers.width, buffers.height);
    const bool done = tuple && vkb_require_tuple(tuple, "core_kernel_size")
                   && PyArg_ParseTuple(tuple, "O&O&", vkb_read_uint32, &kernel->width,
                                       vkb_read_uint32, &kernel->height);

    Py_XDECREF(tuple);
    // No other kernel has this number, and the check of memory is for graphs with one.
    kernel->serial = UINT64_MAX;
    return done;
}

bool vkb_read_kernel(PyObject *object, struct vkb_size frame, struct vkb_size buffers,
                     struct vkb_held_kernel *held, struct vkb_kernel_data *kernel)
{
    PyObject *tuple = PyObject_CallMethod(object, "core_kernel", "(II)(II)", frame.width,
                                          frame.height, buffers.width, buffers.height);
    const bool done = tuple && read_kernel_tuple(tuple, held, kernel);

    Py_XDECREF(tuple);
    return done;
}

void vkb_release_kernel(struct vkb_held_kernel *held)
{
    if (held->held)
        PyBuffer_Release(&held->view);
    held->held = false;
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
