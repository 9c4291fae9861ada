// The arrays that Python gives: their type, their dimensions and their size are checked here.
#include "python/arguments.h"

#include <stdint.h>
#include <string.h>

// The characters of the struct module for the numbers that the core reads.
static const struct number_type {
    char code;
    Py_ssize_t size;
    const char *name;
} number_types[] = {
    {VKB_UINT8, 1, "uint8"},
    {VKB_FLOAT16, 2, "float16"},
    {VKB_FLOAT32, 4, "float32"},
    {VKB_UINT32, 4, "uint32"},
};
enum { NUMBER_TYPES = sizeof number_types / sizeof number_types[0] };

static bool is_little_endian(void)
{
    const uint16_t one = 1;
    unsigned char first;

    memcpy(&first, &one, 1);
    return first;
}

// Without the signs of the host's byte order.
static const char *code_of(const Py_buffer *view)
{
    const char *format = view->format ? view->format : "B";

    return format + (strchr(is_little_endian() ? "@=<" : "@=>!", *format) && *format);
}

bool vkb_is_number(const Py_buffer *view, char type)
{
    const char *code = code_of(view);

    for (size_t i = 0; i < NUMBER_TYPES; ++i)
        if (number_types[i].code == type)
            // On some systems a uint32 is a long.
            return view->itemsize == number_types[i].size && code[0] && !code[1]
                && (code[0] == type || (type == VKB_UINT32 && code[0] == 'L'));
    return false;
}

static const char *type_name(char type)
{
    size_t i = 0;

    while (number_types[i].code != type)
        ++i;
    return number_types[i].name;
}

bool vkb_hold_array(PyObject *object, const char *name, char type, int flags, Py_buffer *view)
{
    if (PyObject_GetBuffer(object, view, flags | PyBUF_FORMAT | PyBUF_C_CONTIGUOUS) < 0)
        return false;
    return vkb_is_number(view, type)
        || vkb_refuse("%s: an array of type '%s' is not one of %s", name, code_of(view),
                      type_name(type));
}

bool vkb_hold_bytes(PyObject *object, const char *name, char type, int flags, size_t size,
                    Py_buffer *view)
{
    if (!vkb_hold_array(object, name, type, flags, view))
        return false;
    return (size_t)view->len == size
        || vkb_refuse("%s: an array of %zu bytes is needed, not of %zd", name, size, view->len);
}

uint32_t vkb_side(Py_ssize_t length)
{
    return length < INT32_MAX ? (uint32_t)length : INT32_MAX;
}
