// Python's images and masks as the core's structs.
#include "python/arguments.h"
#include "python/guard.h"

static enum vkb_format pixel_format(Py_ssize_t channel_size)
{
    return channel_size == 1 ? VKB_FORMAT_RGBA8_UNORM
         : channel_size == 2 ? VKB_FORMAT_RGBA16_FLOAT
                             : VKB_FORMAT_RGBA32_FLOAT;
}

// (Exported, offset, shape, strides, bytes of an element[, images of a batch, their stride])
static bool read_exported(PyObject *tuple, struct vkb_held_image *image)
{
    static VKB_ATOMIC(uint64_t) last_serial;
    struct vkb_input *input = &image->input;
    const struct vkb_exports *exports;
    PyObject *exported;
    Py_ssize_t size;

    if (!PyArg_ParseTuple(tuple, "On(III)(nnn)n|In:image", &exported, &input->offset,
                          &input->height, &input->width, &input->channels, &input->row_stride,
                          &input->pixel_stride, &input->channel_stride, &size, &input->layers,
                          &input->layer_stride))
        return false;
    input->exported = vkb_export_of(exported, &exports);
    input->serial = ++last_serial;
    input->format = pixel_format(size);
    // Released as a view of host memory is.
    image->view = (Py_buffer){.obj = Py_NewRef(exported)};
    return true;
}

// Sides beyond every adapter's limit are refused with the plan.
static uint32_t side_of(Py_ssize_t length)
{
    return length < INT32_MAX ? (uint32_t)length : INT32_MAX;
}

bool vkb_read_image(PyObject *array, struct vkb_held_image *image)
{
    const Py_buffer *view = &image->view;

    if (PyTuple_Check(array))
        return read_exported(array, image);
    if (PyObject_GetBuffer(array, &image->view, PyBUF_STRIDES) < 0)
        return false;
    const bool has_channels = view->ndim == 3;
    image->input = (struct vkb_input){
        .memory = view->buf,
        .row_stride = view->strides[0],
        .pixel_stride = view->strides[1],
        .channel_stride = has_channels ? view->strides[2] : view->itemsize,
        .format = has_channels ? pixel_format(view->itemsize) : VKB_FORMAT_R32_FLOAT,
        .width = side_of(view->shape[1]),
        .height = side_of(view->shape[0]),
        .channels = has_channels ? (uint32_t)view->shape[2] : 1,
    };
    return true;
}
