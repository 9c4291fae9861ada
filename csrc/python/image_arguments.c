// Python's images and masks as the core's structs. All functions return false with an exception
// set.
#include "python/arguments.h"
#include "python/guard.h"
#include "python/values.h"

#include <string.h>

// NumPy writes "=" for unaligned arrays, and "<" or ">" where a dtype names its byte order.
char vkb_element_code(const Py_buffer *view)
{
    const char *format = view->format ? view->format : "B";
    const uint16_t probe = 1;
    const bool is_little = *(const unsigned char *)&probe == 1;
    const bool is_native = *format == '@' || *format == '=' || *format == (is_little ? '<' : '>')
                        || (*format == '!' && !is_little);

    // A byte has no order.
    if (is_native || (view->itemsize == 1 && *format && strchr("<>!", *format)))
        ++format;
    return strlen(format) == 1 ? *format : 0;
}

bool vkb_has_element(const Py_buffer *view, const char *codes)
{
    const char code = vkb_element_code(view);

    return code && strchr(codes, code);
}

enum vkb_format vkb_pixel_format(char code)
{
    return code == 'B' ? VKB_FORMAT_RGBA8_UNORM
         : code == 'e' ? VKB_FORMAT_RGBA16_FLOAT
                       : VKB_FORMAT_RGBA32_FLOAT;
}

static bool has_sides(const Py_buffer *view)
{
    return view->shape[0] >= 1 && view->shape[1] >= 1 && view->shape[0] <= INT32_MAX
        && view->shape[1] <= INT32_MAX;
}

static struct vkb_input input_of(const Py_buffer *view, enum vkb_format format)
{
    const bool has_channels = view->ndim == 3;

    return (struct vkb_input){
        .memory = view->buf,
        .row_stride = view->strides[0],
        .pixel_stride = view->strides[1],
        .channel_stride = has_channels ? view->strides[2] : view->itemsize,
        .format = format,
        .width = (uint32_t)view->shape[1],
        .height = (uint32_t)view->shape[0],
        .channels = has_channels ? (uint32_t)view->shape[2] : 1,
    };
}

// (Exported, offset, shape, strides, code[, images of a batch, their stride])
static bool read_exported(PyObject *tuple, struct vkb_held_image *image)
{
    static VKB_ATOMIC(uint64_t) last_serial;
    struct vkb_input *input = &image->input;
    const struct vkb_exports *exports;
    PyObject *exported;
    Py_ssize_t offset, row, pixel, channel, layer = 0;
    int code;

    if (!PyArg_ParseTuple(tuple, "On(O&O&O&)(nnn)C|O&n:image", &exported, &offset, vkb_read_uint32,
                          &input->height, vkb_read_uint32, &input->width, vkb_read_uint32,
                          &input->channels, &row, &pixel, &channel, &code, vkb_read_uint32,
                          &input->layers, &layer))
        return false;
    if (!vkb_is_exported(exported)) {
        PyErr_SetString(PyExc_TypeError, "image: an Exported is needed");
        return false;
    }
    input->exported = vkb_export_of(exported, &exports);
    input->offset = (size_t)offset;
    input->serial = ++last_serial;
    input->format = vkb_pixel_format((char)code);
    input->row_stride = row;
    input->pixel_stride = pixel;
    input->channel_stride = channel;
    input->layer_stride = layer;
    // Released as a view of host memory is.
    image->view = (Py_buffer){.obj = Py_NewRef(exported)};
    image->held = true;
    return true;
}

// An array with those element types, of two dimensions or, with channels, of three.
static bool read_array(PyObject *array, const char *name, const char *codes, bool has_channels,
                       struct vkb_held_image *image)
{
    const Py_buffer *view = &image->view;

    image->held = PyObject_GetBuffer(array, &image->view, PyBUF_STRIDES | PyBUF_FORMAT) == 0;
    if (!image->held)
        return false;
    if (!vkb_has_element(view, codes)) {
        PyErr_Format(PyExc_TypeError, "%s: elements of the format \"%s\" are not of \"%s\"", name,
                     view->format ? view->format : "B", codes);
        return false;
    }
    if (view->ndim == 2 + has_channels && has_sides(view)
        && (!has_channels || view->shape[2] == 3 || view->shape[2] == 4))
        return true;
    PyErr_Format(PyExc_ValueError, "%s: a shape of %s is needed", name,
                 has_channels ? "(H, W, 3) or (H, W, 4)" : "(H, W)");
    return false;
}

bool vkb_read_image(PyObject *array, const char *name, struct vkb_held_image *image)
{
    if (PyTuple_Check(array))
        return read_exported(array, image);
    if (!read_array(array, name, "Bef", true, image))
        return false;
    image->input = input_of(&image->view, vkb_pixel_format(vkb_element_code(&image->view)));
    return true;
}

bool vkb_read_mask(PyObject *array, struct vkb_held_image *image)
{
    if (!read_array(array, "mask", "f", false, image))
        return false;
    image->input = input_of(&image->view, VKB_FORMAT_R32_FLOAT);
    return true;
}

void vkb_release_image(struct vkb_held_image *image)
{
    if (image->held)
        PyBuffer_Release(&image->view);
    image->held = false;
}
