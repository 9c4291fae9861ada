// The Screen type: a surface on which a renderer presents framebuffers.
#include "python/module.h"

static struct vkb_module_state *state_of(PyObject *object)
{
    return PyType_GetModuleState(Py_TYPE(object));
}

bool vkb_require_screen(const struct vkb_screen_object *screen, struct vkb_error *error)
{
    return screen->screen || vkb_fail(error, VKB_ERROR_VALUE, "the surface is closed");
}

PyObject *vkb_new_screen(PyObject *object, PyObject *arguments)
{
    struct vkb_renderer *renderer = (struct vkb_renderer *)object;
    unsigned long long surface;
    int mailbox;
    struct vkb_error error = {0};

    if (!PyArg_ParseTuple(arguments, "Kp:screen", &surface, &mailbox))
        return NULL;
    struct vkb_screen_object *self = vkb_new_object(state_of(object)->screen_type);
    if (!self)
        return NULL;
    self->renderer = (struct vkb_renderer *)Py_NewRef(object);
    bool done = vkb_renderer_enter(renderer, &error);
    if (done) {
        if (vkb_require_open(renderer, &error))
            self->screen = vkb_screen_create(&renderer->device, &renderer->frame,
                                             (VkSurfaceKHR)surface, mailbox, &error);
        done = vkb_renderer_check_messages(renderer, self->screen != NULL, &error);
        vkb_renderer_leave(renderer);
    }
    if (done)
        return (PyObject *)self;
    vkb_raise(state_of(object), &error);
    Py_DECREF(self);
    return NULL;
}

static PyObject *close_screen(PyObject *object, PyObject *unused)
{
    struct vkb_screen_object *self = (struct vkb_screen_object *)object;
    struct vkb_renderer *renderer = self->renderer;
    struct vkb_error error = {0};
    bool done = true;

    (void)unused;
    // In a forked process there is no device.
    if (!self->screen || !vkb_renderer_is_ours(renderer))
        Py_RETURN_NONE;
    if (!vkb_renderer_enter(renderer, &error))
        return vkb_raise(state_of(object), &error);
    // A closed renderer has destroyed it, one with a lost device will.
    if (renderer->open && self->screen && !renderer->device.lost) {
        done = vkb_submissions_wait(&renderer->device, &renderer->frame.submissions, &error);
        if (done)
            vkb_screen_destroy(&renderer->device, &renderer->frame, self->screen);
    }
    if (done)
        self->screen = NULL;
    done = vkb_renderer_check_messages(renderer, done, &error);
    vkb_renderer_leave(renderer);
    return done ? Py_NewRef(Py_None) : vkb_raise(state_of(object), &error);
}

static int traverse(PyObject *object, visitproc visit, void *arg)
{
    Py_VISIT(Py_TYPE(object));
    Py_VISIT((PyObject *)((struct vkb_screen_object *)object)->renderer);
    return 0;
}

// The renderer keeps a screen that was not closed until it is closed itself.
static int clear(PyObject *object)
{
    Py_CLEAR(((struct vkb_screen_object *)object)->renderer);
    return 0;
}

static PyMethodDef methods[] = {
    {"close", close_screen, METH_NOARGS,
     "Waits for the device and destroys the surface; may be called twice."},
    {0},
};

static PyType_Slot slots[] = {
    {Py_tp_dealloc, vkb_dealloc},
    {Py_tp_traverse, traverse},
    {Py_tp_clear, clear},
    {Py_tp_methods, methods},
    {Py_tp_doc, "A surface on which framebuffers are presented."},
    {0},
};

PyType_Spec vkb_screen_spec = {
    .name = "vkbloom._core.Screen",
    .basicsize = sizeof(struct vkb_screen_object),
    .flags = VKB_TYPE_FLAGS | Py_TPFLAGS_HAVE_GC,
    .slots = slots,
};
