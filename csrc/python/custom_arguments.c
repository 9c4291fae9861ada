// Shaders that are made at run time, and the passes of a settings object that run them.
#include "python/arguments.h"
#include "python/module.h"
#include "python/values.h"

#include <stdio.h>
#include <string.h>

// The name of the shader object lives as long as `name`.
struct shader_object {
    PyObject_HEAD
    PyObject *name;
    struct vkb_shader shader, dispatch;
};

static bool read_hash(const Py_buffer *code, struct vkb_hash *hash)
{
    PyObject *hashlib = PyImport_ImportModule("hashlib");
    PyObject *sum = hashlib ? PyObject_CallMethod(hashlib, "sha256", "O", code->obj) : NULL;
    PyObject *digest = sum ? PyObject_CallMethod(sum, "digest", NULL) : NULL;

    if (digest)
        memcpy(hash->bytes, PyBytes_AsString(digest), sizeof hash->bytes);
    Py_XDECREF(digest);
    Py_XDECREF(sum);
    Py_XDECREF(hashlib);
    return digest;
}

static bool read_code(const Py_buffer *code, const char *name, struct vkb_shader *shader)
{
    enum { MAGIC = 0x07230203, HEADER_BYTES = 20 };
    struct vkb_error error;
    uint32_t magic = 0;

    if (code->len >= HEADER_BYTES)
        memcpy(&magic, code->buf, sizeof magic);
    if (magic != MAGIC || code->len % 4 != 0) {
        PyErr_Format(PyExc_ValueError, "shader: %s is not SPIR-V", name);
        return false;
    }
    void *copy = vkb_alloc(&error, (size_t)code->len, 1);
    if (!copy) {
        PyErr_NoMemory();
        return false;
    }
    memcpy(copy, code->buf, (size_t)code->len);
    *shader = (struct vkb_shader){.name = name, .code = copy, .size = (size_t)code->len};
    return read_hash(code, &shader->hash);
}

static PyObject *new_shader(const struct vkb_module_state *state, PyObject *name,
                            const Py_buffer *code, const Py_buffer *dispatch)
{
    struct shader_object *self = vkb_new_object(state->shader_type);

    if (!self)
        return NULL;
    self->name = Py_NewRef(name);
    const char *text = PyUnicode_AsUTF8AndSize(name, NULL);
    if (!text || !read_code(code, text, &self->shader)
        || (dispatch->buf && !read_code(dispatch, text, &self->dispatch))) {
        Py_DECREF(self);
        return NULL;
    }
    self->shader.dispatch = dispatch->buf ? &self->dispatch : NULL;
    return (PyObject *)self;
}

PyObject *vkb_make_shader(PyObject *module, PyObject *arguments)
{
    PyObject *name;
    Py_buffer code = {0}, dispatch = {0};

    if (!PyArg_ParseTuple(arguments, "Uy*|z*:shader", &name, &code, &dispatch))
        return NULL;
    PyObject *shader = new_shader(vkb_module_state(module), name, &code, &dispatch);
    PyBuffer_Release(&code);
    if (dispatch.obj)
        PyBuffer_Release(&dispatch);
    return shader;
}

static void dealloc(PyObject *object)
{
    struct shader_object *self = (struct shader_object *)object;

    vkb_free((void *)self->shader.code);
    vkb_free((void *)self->dispatch.code);
    Py_XDECREF(self->name);
    vkb_free_object(object);
}

static PyObject *get_name(PyObject *object, void *unused)
{
    (void)unused;
    return Py_NewRef(((struct shader_object *)object)->name);
}

static PyObject *get_hash(PyObject *object, void *unused)
{
    const struct vkb_hash *hash = &((struct shader_object *)object)->shader.hash;
    char text[2 * sizeof hash->bytes + 1];

    (void)unused;
    for (size_t i = 0; i < sizeof hash->bytes; ++i)
        snprintf(text + 2 * i, 3, "%02x", hash->bytes[i]);
    return PyUnicode_FromString(text);
}

static PyGetSetDef attributes[] = {
    {"name", get_name, NULL, "Its name in plans.", NULL},
    {"hash", get_hash, NULL, "The first 16 bytes of the SHA-256 of its SPIR-V, in hex.", NULL},
    {0},
};

static PyType_Slot slots[] = {
    {Py_tp_dealloc, dealloc},
    {Py_tp_getset, attributes},
    {Py_tp_doc, "A shader that was made at run time."},
    {0},
};

PyType_Spec vkb_shader_spec = {
    .name = "vkbloom._core.Shader",
    .basicsize = sizeof(struct shader_object),
    .flags = VKB_TYPE_FLAGS,
    .slots = slots,
};

static bool copy_name(const char *name, char copy[VKB_NAME_SIZE])
{
    const size_t length = strlen(name);

    if (length == 0 || length >= VKB_NAME_SIZE) {
        PyErr_Format(PyExc_ValueError, "passes: the name '%s' has not 1 to %d bytes", name,
                     VKB_NAME_SIZE - 1);
        return false;
    }
    memcpy(copy, name, length + 1);
    return true;
}

static bool read_reads(PyObject *names, struct vkb_custom_pass *pass)
{
    const Py_ssize_t count = PyTuple_Size(names);

    if (count > VKB_MAX_READS) {
        PyErr_Format(PyExc_ValueError, "passes: %s reads %zd images, more than %d", pass->name,
                     count, VKB_MAX_READS);
        return false;
    }
    for (; pass->read_count < count; ++pass->read_count) {
        PyObject *item = PyTuple_GetItem(names, pass->read_count);
        const char *name = PyUnicode_AsUTF8AndSize(item, NULL);
        if (!name || !copy_name(name, pass->reads[pass->read_count]))
            return false;
    }
    return true;
}

static bool read_content(const Py_buffer *params, const char *format, PyObject *block,
                         struct vkb_custom_pass *pass)
{
    if (params->len > (Py_ssize_t)sizeof pass->params) {
        PyErr_Format(PyExc_ValueError, "passes: %s has %zd bytes of parameters, more than %zu",
                     pass->name, params->len, sizeof pass->params);
        return false;
    }
    memcpy(&pass->params, params->buf, (size_t)params->len);
    pass->format = format ? vkb_format_by_name(format) : VKB_FORMAT_NONE;
    if (format && (!pass->format || vkb_formats[pass->format].channels == 1)) {
        PyErr_Format(PyExc_ValueError, "passes: %s: '%s' is not a format of bloom buffers",
                     pass->name, format);
        return false;
    }
    if (block == Py_None)
        return true;
    if (!vkb_require_tuple(block, "passes: block")
        || !PyArg_ParseTuple(block, "O&O&:block", vkb_read_uint32, &pass->block_width,
                             vkb_read_uint32, &pass->block_height))
        return false;
    if (pass->block_width && pass->block_height)
        return true;
    PyErr_Format(PyExc_ValueError, "passes: %s has a block without pixels", pass->name);
    return false;
}

static bool read_resources(const struct vkb_module_state *state, PyObject *resources,
                           struct vkb_custom_pass *pass)
{
    const Py_ssize_t count = PyTuple_Size(resources);

    if (count > VKB_MAX_RESOURCES) {
        PyErr_Format(PyExc_ValueError, "passes: %s has %zd textures and buffers, more than %d",
                     pass->name, count, VKB_MAX_RESOURCES);
        return false;
    }
    for (; pass->resource_count < count; ++pass->resource_count) {
        PyObject *item = PyTuple_GetItem(resources, pass->resource_count);
        if (!PyObject_TypeCheck(item, (PyTypeObject *)state->resource_type)) {
            PyErr_Format(PyExc_TypeError, "passes: %R is not a Resource", item);
            return false;
        }
        pass->resources[pass->resource_count] = vkb_resource_of(item);
    }
    return true;
}

// (name, shader, (width, height), format or None, (name of an image read, ...), whether it is a
// framebuffer, bytes of its parameters, (width, height) of a workgroup's pixels or None, and where
// it has them (resource, ...) and its turn)
static bool read_pass(const struct vkb_module_state *state, PyObject *tuple,
                      struct vkb_custom_pass *pass)
{
    const char *name, *format;
    PyObject *shader, *reads, *block, *resources = NULL;
    unsigned long long turn = 0;
    Py_buffer params = {0};
    int framebuffer;

    if (!vkb_require_tuple(tuple, "core_passes")
        || !PyArg_ParseTuple(tuple, "sO!(O&O&)zO!py*O|O!K:core_passes", &name, state->shader_type,
                             &shader, vkb_read_uint32, &pass->width, vkb_read_uint32, &pass->height,
                             &format, &PyTuple_Type, &reads, &framebuffer, &params, &block,
                             &PyTuple_Type, &resources, &turn))
        return false;
    pass->shader = &((struct shader_object *)shader)->shader;
    pass->framebuffer = framebuffer;
    pass->turn = turn;
    const bool done = copy_name(name, pass->name) && read_reads(reads, pass)
                   && read_content(&params, format, block, pass)
                   && (!resources || read_resources(state, resources, pass));
    PyBuffer_Release(&params);
    return done;
}

static bool read_passes(const struct vkb_module_state *state, struct vkb_held_passes *held,
                        struct vkb_settings *settings)
{
    struct vkb_error error;

    if (!vkb_require_tuple(held->tuple, "core_passes"))
        return false;
    const Py_ssize_t count = PyTuple_Size(held->tuple);
    held->rows = vkb_alloc(&error, (size_t)count + 1, sizeof *held->rows);
    if (!held->rows) {
        PyErr_NoMemory();
        return false;
    }
    settings->passes = held->rows;
    for (; settings->pass_count < count; ++settings->pass_count)
        if (!read_pass(state, PyTuple_GetItem(held->tuple, settings->pass_count),
                       &held->rows[settings->pass_count]))
            return false;
    return true;
}

bool vkb_hold_passes(const struct vkb_module_state *state, PyObject *object, uint32_t max_side,
                     const struct vkb_source *source, struct vkb_held_passes *held,
                     struct vkb_settings *settings)
{
    struct vkb_size frame, buffers;
    struct vkb_error error = {0};

    if (settings->method != VKB_METHOD_CUSTOM || !settings->values.bloom)
        return true;
    if (!vkb_source_sizes(source, settings, max_side, &frame, &buffers, &error)) {
        vkb_raise(state, &error);
        return false;
    }
    held->tuple = PyObject_CallMethod(object, "core_passes", "(II)(II)", frame.width, frame.height,
                                      buffers.width, buffers.height);
    return held->tuple && read_passes(state, held, settings);
}

void vkb_release_passes(struct vkb_held_passes *held)
{
    Py_CLEAR(held->tuple);
    vkb_free(held->rows);
    held->rows = NULL;
}
