// The Pages type: a run of a renderer's pages with the buffer protocol. NumPy arrays are views of
// it. The pages are returned when the last view is gone, which may be long after the renderer is
// closed.
#include "python/module.h"
#include "python/renderer.h"

struct pages_object {
    PyObject_HEAD
    struct vkb_pages *pages;
    struct vkb_page_run *run;
    Py_ssize_t size;  // the requested size; the run may be larger
    long process;     // the process that opened the renderer
};

PyObject *vkb_new_pages(PyObject *object, PyObject *argument)
{
    struct vkb_renderer *renderer = (struct vkb_renderer *)object;
    struct vkb_module_state *state = PyType_GetModuleState(Py_TYPE(object));
    const Py_ssize_t size = PyLong_AsSsize_t(argument);
    struct vkb_error error = {0};

    if (PyErr_Occurred() || !vkb_check_bytes("pages", size))
        return NULL;
    struct pages_object *self = vkb_new_object(state->pages_type);
    if (!self)
        return NULL;
    self->size = size;
    self->process = renderer->process;
    VKB_LOCK(vkb_memory);
    if (vkb_require_open(renderer, &error)) {
        self->pages = renderer->pages;
        self->run = vkb_pages_take(self->pages, (size_t)size, &error);
    }
    VKB_UNLOCK(vkb_memory);
    if (self->run)
        return (PyObject *)self;
    Py_DECREF(self);
    return vkb_raise(state, &error);
}

static void dealloc(PyObject *object)
{
    struct pages_object *self = (struct pages_object *)object;

    // A forked process returns nothing: the device belongs to its parent.
    if (self->run && self->process == vkb_current_process()) {
        VKB_LOCK(vkb_memory);
        vkb_pages_give_back(self->pages, self->run);
        VKB_UNLOCK(vkb_memory);
    }
    vkb_free_object(object);
}

static int get_buffer(PyObject *object, Py_buffer *view, int flags)
{
    struct pages_object *self = (struct pages_object *)object;

    return PyBuffer_FillInfo(view, object, self->run->memory, self->size, 0, flags);
}

static Py_ssize_t length(PyObject *object)
{
    return ((struct pages_object *)object)->size;
}

static PyType_Slot slots[] = {
    {Py_tp_dealloc, dealloc},
    {Py_bf_getbuffer, get_buffer},
    {Py_sq_length, length},
    {Py_tp_doc, "Memory of a renderer, to which the device writes without a copy."},
    {0},
};

// No garbage collection: it holds no references to objects.
PyType_Spec vkb_pages_spec = {
    .name = "vkbloom._core.Pages",
    .basicsize = sizeof(struct pages_object),
    .flags = VKB_TYPE_FLAGS,
    .slots = slots,
};
