// Python's images and masks as the core's structs.
#include "python/arguments.h"
#include "python/guard.h"

static enum vkb_format pixel_format(Py_ssize_t channel_size)
{
    return channel_size == 1 ? VKB_FORMAT_RGBA8_UNORM
         : channel_size == 2 ? VKB_FORMAT_RGBA16_FLOAT
         : channel_size == 4 ? VKB_FORMAT_RGBA32_FLOAT
                             : VKB_FORMAT_NONE;
}

static bool check_channels(const char *name, Py_ssize_t channels, bool grey)
{
    return (grey ? channels == 1 : channels == 3 || channels == 4)
        || vkb_refuse("%s: the number of channels, %zd, is not %s", name, channels,
                      grey ? "1" : "3 or 4");
}

// Whether all elements lie in the memory. In doubles, since products of strides may not fit.
static bool check_span(const char *name, const struct vkb_input *input)
{
    const uint32_t counts[] = {input->height, input->width, input->channels,
                               input->layers ? input->layers : 1};
    const ptrdiff_t strides[] = {input->row_stride, input->pixel_stride, input->channel_stride,
                                 input->layer_stride};
    double first = (double)(ptrdiff_t)input->offset,
           last = first + vkb_formats[input->format].channel_size;

    for (int axis = 0; axis < 4; ++axis) {
        const double reach = (double)strides[axis] * ((double)counts[axis] - 1.0);
        *(reach < 0.0 ? &first : &last) += reach;
    }
    return (first >= 0.0 && last <= (double)input->exported->size)
        || vkb_refuse("%s: its elements lie outside of its memory", name);
}

// (Exported, offset, shape, strides, bytes of an element[, images of a batch, their stride])
static bool read_exported(PyObject *tuple, const char *name, bool grey,
                          struct vkb_held_image *image)
{
    struct vkb_input *input = &image->input;
    const struct vkb_exports *exports;
    PyObject *exported;
    Py_ssize_t size;

    if (!PyArg_ParseTuple(tuple, "On(III)(nnn)n|In:image", &exported, &input->offset,
                          &input->height, &input->width, &input->channels, &input->row_stride,
                          &input->pixel_stride, &input->channel_stride, &size, &input->layers,
                          &input->layer_stride))
        return false;
    if (!vkb_is_exported(exported)) {
        PyErr_Format(PyExc_TypeError, "%s: %R is not memory of a device", name, exported);
        return false;
    }
    // Released as a view of host memory is.
    image->view = (Py_buffer){.obj = Py_NewRef(exported)};
    input->exported = vkb_export_of(exported, &exports);
    input->pixels = (struct vkb_pixels_key){
        .serial = input->exported->serial,
        .offset = input->offset,
        .row_stride = input->row_stride,
        .pixel_stride = input->pixel_stride,
        .channel_stride = input->channel_stride,
        .layer_stride = input->layers ? input->layer_stride : 0,
        .channels = input->channels,
    };
    input->format = pixel_format(size);
    if (input->format == VKB_FORMAT_NONE)
        return vkb_refuse("%s: elements of %zd bytes are not those of uint8, float16 or float32",
                          name, size);
    if (input->width == 0 || input->height == 0)
        return vkb_refuse("%s: a size of %u x %u is out of range, sides of at least 1", name,
                          input->width, input->height);
    return check_channels(name, input->channels, grey) && check_span(name, input);
}

static bool check_numbers(const char *name, const Py_buffer *view, bool grey)
{
    const bool right =
        vkb_is_number(view, VKB_FLOAT32)
        || (!grey && (vkb_is_number(view, VKB_UINT8) || vkb_is_number(view, VKB_FLOAT16)));

    return (right && view->ndim == (grey ? 2 : 3))
        || vkb_refuse("%s: an array with %d dimensions of type '%s' is not %s", name, view->ndim,
                      view->format ? view->format : "B",
                      grey ? "(H, W) of float32"
                           : "(H, W, 3) or (H, W, 4) of uint8, float16 or float32");
}

static bool hold_image(PyObject *array, const char *name, bool grey, struct vkb_held_image *image)
{
    const Py_buffer *view = &image->view;

    if (PyObject_GetBuffer(array, &image->view, PyBUF_RECORDS_RO) < 0
        || !check_numbers(name, view, grey)
        || !(grey || check_channels(name, view->shape[2], false)))
        return false;
    image->input = (struct vkb_input){
        .memory = view->buf,
        .row_stride = view->strides[0],
        .pixel_stride = view->strides[1],
        .channel_stride = grey ? view->itemsize : view->strides[2],
        .format = grey ? VKB_FORMAT_R32_FLOAT : pixel_format(view->itemsize),
        .width = vkb_side(view->shape[1]),
        .height = vkb_side(view->shape[0]),
        .channels = grey ? 1 : (uint32_t)view->shape[2],
    };
    return true;
}

static bool read_any(PyObject *array, const char *name, bool grey, struct vkb_held_image *image)
{
    return PyTuple_Check(array) ? read_exported(array, name, grey, image)
                                : hold_image(array, name, grey, image);
}

bool vkb_read_image(PyObject *array, const char *name, struct vkb_held_image *image)
{
    return read_any(array, name, false, image);
}

bool vkb_read_grey(PyObject *array, const char *name, struct vkb_held_image *image)
{
    return read_any(array, name, true, image);
}
