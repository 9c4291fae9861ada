// The lock of a renderer, and the submissions that nobody waits for any more.
#include "python/plan.h"

VKB_GUARD(vkb_memory)

#ifdef Py_GIL_DISABLED
#include <pthread.h>

// A thread of the parent may have held it, which does not exist in the child.
static void free_memory_guard(void)
{
    vkb_memory = (PyMutex){0};
}

bool vkb_guards_begin(void)
{
    return pthread_atfork(NULL, NULL, free_memory_guard) == 0;
}
#else
bool vkb_guards_begin(void)
{
    return true;
}
#endif

void vkb_pending_use(struct vkb_pending *pending, PyObject *object)
{
    const struct vkb_source_object *source = (struct vkb_source_object *)object;

    pending->sources[pending->source_count++] = Py_NewRef(object);
    VKB_LOCK(vkb_memory);
    if (source->resident)
        ++source->resident->uses;
    VKB_UNLOCK(vkb_memory);
}

// No other source takes the memory of one that is used, so it has the resident image still.
static void end_use(PyObject *object)
{
    const struct vkb_source_object *source = (struct vkb_source_object *)object;

    // In a forked process the device is the parent's.
    if (source->resident && source->process == vkb_current_process()) {
        VKB_LOCK(vkb_memory);
        vkb_resident_end_use(source->residents, source->resident);
        VKB_UNLOCK(vkb_memory);
    }
    Py_DECREF(object);
}

static void release_views(struct vkb_pending *pending)
{
    while (pending->view_count > 0) {
        --pending->view_count;
        PyBuffer_Release(&pending->views[pending->view_count]);
    }
}

void vkb_pending_release(struct vkb_pending *pending)
{
    PyObject *type, *value, *traceback;

    // Released objects may run Python code.
    PyErr_Fetch(&type, &value, &traceback);
    release_views(pending);
    vkb_free(pending->requests);
    vkb_free(pending->outputs);
    vkb_free(pending->views);
    vkb_free(pending->timings);
    vkb_free(pending->layer_non_finite);
    Py_XDECREF(pending->plans);
    while (pending->source_count > 0)
        end_use(pending->sources[--pending->source_count]);
    vkb_free(pending);
    PyErr_Restore(type, value, traceback);
}

int vkb_pending_traverse(const struct vkb_pending *pending, visitproc visit, void *arg)
{
    Py_VISIT(pending->plans);
    for (uint32_t i = 0; i < pending->source_count; ++i)
        Py_VISIT(pending->sources[i]);
    for (size_t i = 0; i < pending->view_count; ++i)
        Py_VISIT(pending->views[i].obj);
    return 0;
}

bool vkb_renderer_is_ours(const struct vkb_renderer *self)
{
    return self->process == vkb_current_process();
}

static bool require_ours(const struct vkb_renderer *self, struct vkb_error *error)
{
    return vkb_renderer_is_ours(self)
        || vkb_fail(error, VKB_ERROR_VALUE,
                    "the renderer was opened in another process, from which this one was forked; "
                    "open one here, or, where the driver opens none after a fork, start processes "
                    "by multiprocessing's method \"spawn\"");
}

// Called between the slices of a wait: whether a signal handler raised an exception.
bool vkb_renderer_interrupted(void *context)
{
    struct vkb_renderer *self = context;

    PyEval_RestoreThread(self->thread);
    const bool raised = PyErr_CheckSignals() < 0;
    self->thread = PyEval_SaveThread();
    return raised;
}

static bool acquire_lock(struct vkb_renderer *self, struct vkb_error *error)
{
    const long long slice = 50000;  // microseconds
    PyLockStatus status = PyThread_acquire_lock_timed(self->lock, 0, 0);

    while (status != PY_LOCK_ACQUIRED) {
        Py_BEGIN_ALLOW_THREADS
        status = PyThread_acquire_lock_timed(self->lock, slice, 0);
        Py_END_ALLOW_THREADS
        if (status != PY_LOCK_ACQUIRED && PyErr_CheckSignals() < 0)
            return vkb_fail(error, VKB_ERROR_INTERRUPTED, "interrupted");
    }
    return true;
}

// Removes the finished submissions from the abandoned ones and returns them. With the lock, the
// guard and the GIL, or without a device.
static struct vkb_pending *take_over(struct vkb_renderer *self)
{
    struct vkb_pending **link = &self->abandoned, *over = NULL;

    while (*link) {
        struct vkb_pending *pending = *link;
        // Without a device, all are finished. A busy device that was not destroyed keeps its own.
        if (self->device.handle
            && !(self->open && vkb_frame_drop(&self->device, &self->frame, pending->submission))) {
            link = &pending->next;
            continue;
        }
        *link = pending->next;
        pending->next = over;
        over = pending;
    }
    return over;
}

// Called with the GIL and without the lock: it may run Python code, which may wait for a thread
// that waits for the renderer.
static void release_all(struct vkb_pending *over)
{
    while (over) {
        struct vkb_pending *next = over->next;
        vkb_pending_release(over);
        over = next;
    }
}

void vkb_renderer_release_finished(struct vkb_renderer *self)
{
    release_all(take_over(self));
}

void vkb_renderer_abandon(struct vkb_renderer *self, struct vkb_pending *pending)
{
    VKB_LOCK(self->guard);
    pending->next = self->abandoned;
    self->abandoned = pending;
    VKB_UNLOCK(self->guard);
}

bool vkb_renderer_enter(struct vkb_renderer *self, struct vkb_error *error)
{
    if (!require_ours(self, error))
        return false;
    if (self->holder == PyThread_get_thread_ident())
        return vkb_fail(error, VKB_ERROR_GENERAL,
                        "the renderer is at work in this thread, which a signal's handler or a "
                        "finalizer has interrupted");
    if (!acquire_lock(self, error))
        return false;
    self->holder = PyThread_get_thread_ident();
    self->thread = PyEval_SaveThread();
    self->before = vkb_messages_begin(&self->device.messages);
    return true;
}

void vkb_renderer_leave(struct vkb_renderer *self)
{
    vkb_renderer_leave_with(self, NULL);
}

void vkb_renderer_leave_with(struct vkb_renderer *self, struct vkb_exports *exports)
{
    PyEval_RestoreThread(self->thread);
    if (exports) {
        VKB_LOCK(vkb_memory);
        self->exports = exports;
        VKB_UNLOCK(vkb_memory);
    }
    VKB_LOCK(self->guard);
    if (self->open) {
        self->pipeline_count = self->frame.pipelines.created;
        self->cached = vkb_frame_cached(&self->frame);
    }
    struct vkb_pending *over = take_over(self);
    VKB_UNLOCK(self->guard);
    vkb_messages_end(self->before);
    self->holder = 0;
    PyThread_release_lock(self->lock);
    release_all(over);
}

bool vkb_renderer_check_messages(struct vkb_renderer *self, bool done, struct vkb_error *error)
{
    if (!self->open || (!done && error->kind == VKB_ERROR_INTERRUPTED))
        return done;
    return vkb_messages_check(&self->device.messages, error) && done;
}

bool vkb_require_open(const struct vkb_renderer *self, struct vkb_error *error)
{
    if (!self->open)
        return vkb_fail(error, VKB_ERROR_VALUE, "the renderer is closed");
    if (!require_ours(self, error))
        return false;
    return vkb_device_require(&self->device, error);
}
