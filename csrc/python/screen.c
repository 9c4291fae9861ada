// Screens of a renderer. Python knows them by their addresses, which are looked up.
#include "python/module.h"
#include "python/renderer.h"

bool vkb_require_screen(const struct vkb_renderer *renderer, const struct vkb_screen *screen,
                        struct vkb_error *error)
{
    const struct vkb_screen *one = renderer->frame.screens;

    while (one && one != screen)
        one = one->next;
    return one || vkb_fail(error, VKB_ERROR_VALUE, "the surface is closed");
}

PyObject *vkb_open_screen(PyObject *object, PyObject *arguments)
{
    struct vkb_renderer *renderer = (struct vkb_renderer *)object;
    unsigned long long surface;
    struct vkb_screen *screen = NULL;
    struct vkb_error error = {0};

    if (!PyArg_ParseTuple(arguments, "K:open_screen", &surface))
        return NULL;
    bool done = vkb_renderer_enter(renderer, &error);
    if (done) {
        done = vkb_require_open(renderer, &error)
            && (screen = vkb_screen_create(&renderer->device, (VkSurfaceKHR)surface,
                                           &renderer->frame.screens, &error));
        done = vkb_renderer_check_messages(renderer, done, &error);
        vkb_renderer_leave(renderer);
    }
    return done ? PyLong_FromVoidPtr(screen)
                : vkb_raise(PyType_GetModuleState(Py_TYPE(object)), &error);
}

PyObject *vkb_close_screen(PyObject *object, PyObject *number)
{
    struct vkb_renderer *renderer = (struct vkb_renderer *)object;
    struct vkb_screen *screen = PyLong_AsVoidPtr(number);
    struct vkb_error error = {0};

    // In a forked process there is no device.
    if (PyErr_Occurred() || !vkb_renderer_is_ours(renderer))
        return PyErr_Occurred() ? NULL : Py_NewRef(Py_None);
    bool done = vkb_renderer_enter(renderer, &error);
    if (done) {
        // A closed renderer has destroyed it, one with a lost device will.
        if (!renderer->device.lost && vkb_require_screen(renderer, screen, &error)) {
            done = vkb_frame_end(&renderer->device, &renderer->frame, &error);
            if (done)
                vkb_screen_destroy(&renderer->device, screen, &renderer->frame.screens);
        }
        done = vkb_renderer_check_messages(renderer, done, &error);
        vkb_renderer_leave(renderer);
    }
    return done ? Py_NewRef(Py_None) : vkb_raise(PyType_GetModuleState(Py_TYPE(object)), &error);
}
