// The Renderer type: a device with everything on it.
#include "python/renderer.h"
#include "python/module.h"

static struct vkb_module_state *state_of(PyObject *self)
{
    return PyType_GetModuleState(Py_TYPE(self));
}

// create(adapter, driver, validation, variants, read_cache): read_cache(driver_uuid) returns the
// stored pipeline cache as bytes, or None.
static bool create(struct vkb_renderer *self, uint32_t adapter, const char *driver, bool validation,
                   const char *variants, PyObject *read_cache, struct vkb_error *error)
{
    bool done;
    char *data = NULL;
    Py_ssize_t size = 0;

    Py_BEGIN_ALLOW_THREADS
    done = vkb_device_create(&self->device, adapter, driver, validation, error);
    Py_END_ALLOW_THREADS
    if (!done)
        return false;
    if (!vkb_variants_by_name(variants, &self->device, &self->variants, error)) {
        vkb_device_destroy(&self->device);
        return false;
    }
    PyObject *cache = PyObject_CallFunction(read_cache, "y#", self->device.adapter.driver_uuid,
                                            (Py_ssize_t)VK_UUID_SIZE);
    if (cache && cache != Py_None && PyBytes_AsStringAndSize(cache, &data, &size) < 0)
        Py_CLEAR(cache);
    if (!cache) {
        vkb_device_destroy(&self->device);
        return false;
    }
    Py_BEGIN_ALLOW_THREADS
    const struct vkb_messages *before = vkb_messages_begin(&self->device.messages);
    done = vkb_frame_create(&self->device, data, (size_t)size, &self->frame, error)
        && vkb_messages_check(&self->device.messages, error);
    if (!done) {
        vkb_frame_destroy(&self->device, &self->frame);
        vkb_device_destroy(&self->device);
    }
    vkb_messages_end(before);
    Py_END_ALLOW_THREADS
    Py_DECREF(cache);
    return done;
}

static PyObject *new_renderer(PyTypeObject *type, PyObject *arguments, PyObject *keywords)
{
    static VKB_ATOMIC(uint64_t) last_number;
    const char *driver, *variants;
    uint32_t adapter;
    int validation;
    double frame_seconds;
    PyObject *read_cache;
    struct vkb_error error = {0};

    (void)keywords;
    if (!PyArg_ParseTuple(arguments, "IspsdO:Renderer", &adapter, &driver, &validation, &variants,
                          &frame_seconds, &read_cache))
        return NULL;
    if (!(frame_seconds > 0.0)) {
        vkb_refuse("frame_seconds: %g is out of range, above 0", frame_seconds);
        return NULL;
    }
    struct vkb_renderer *self = vkb_new_object((PyObject *)type);
    if (!self)
        return NULL;
    self->number = ++last_number;
    self->process = vkb_current_process();
    self->lock = PyThread_allocate_lock();
    if (!self->lock)
        PyErr_NoMemory();
    else if ((self->pages = vkb_pages_create(&self->device, &error))
             && (self->residents = vkb_residents_create(&self->device, &error)))
        self->open = create(self, adapter, driver, validation, variants, read_cache, &error);
    if (self->open) {
        self->device.interrupted = vkb_renderer_interrupted;
        self->device.context = self;
        self->device.frame_seconds = frame_seconds;
        return (PyObject *)self;
    }
    if (error.kind != VKB_OK)
        vkb_raise(PyType_GetModuleState(type), &error);
    Py_DECREF(self);
    return NULL;
}

// Arrays and handles that are left keep what is theirs. Called with the lock, or at the end.
static void close_memory(struct vkb_renderer *self, bool settled)
{
    VKB_LOCK(vkb_memory);
    struct vkb_exports *exports = self->exports;
    vkb_pages_close(self->pages);
    vkb_residents_close(self->residents);
    if (exports)
        vkb_exports_close(exports, settled);
    self->pages = NULL;
    self->residents = NULL;
    self->exports = NULL;
    VKB_UNLOCK(vkb_memory);
    if (exports)
        vkb_release_exports(exports);
}

static void drop_transposes(struct vkb_renderer *self)
{
    VKB_LOCK(self->guard);
    vkb_transposes_destroy(&self->transposes);
    VKB_UNLOCK(self->guard);
}

// Streams of CUDA may still wait for the device, which has finished everything. False: some may
// wait afterwards, too.
static bool end_waits(struct vkb_renderer *self)
{
    bool settled;

    VKB_LOCK(vkb_memory);
    struct vkb_exports *exports = self->exports;
    vkb_exports_complete(exports);
    VKB_UNLOCK(vkb_memory);
    Py_BEGIN_ALLOW_THREADS
    settled = vkb_exports_settle(exports);
    Py_END_ALLOW_THREADS
    return settled;
}

// Called with the lock and without the GIL. The validation layer reports objects that were not
// destroyed. After an interrupted wait the renderer stays open. A device that is busy for too long
// is not destroyed, nor is anything that it may still use.
static bool destroy(struct vkb_renderer *self, struct vkb_error *error)
{
    if (!self->open)
        return true;
    if (self->device.timed_out)
        self->device.frame_seconds = 0.0;  // one slice: an earlier wait has timed out
    if (!vkb_frame_end(&self->device, &self->frame, error)) {
        if (error->kind == VKB_ERROR_INTERRUPTED)
            return false;
        self->open = false;
        return vkb_fail(error, VKB_ERROR_DEVICE_LOST,
                        "the device is still busy; what it uses is kept until the process ends");
    }
    self->open = false;
    vkb_frame_destroy(&self->device, &self->frame);
    PyEval_RestoreThread(self->thread);
    const bool settled = end_waits(self);
    close_memory(self, settled);
    drop_transposes(self);
    self->thread = PyEval_SaveThread();
    vkb_device_destroy(&self->device);
    return vkb_messages_check(&self->device.messages, error);
}

// Called between the slices of a wait in dealloc, where no exception can be raised: Ctrl-C ends the
// wait, and its handler runs when Python code continues.
static bool interrupted_at_the_end(void *context)
{
    struct vkb_renderer *self = context;

    PyEval_RestoreThread(self->thread);
    const bool pressed = PyOS_InterruptOccurred();
    if (pressed)
        PyErr_SetInterrupt();
    self->thread = PyEval_SaveThread();
    return pressed;
}

static void dealloc(PyObject *object)
{
    struct vkb_renderer *self = (struct vkb_renderer *)object;
    struct vkb_error error = {0};

    PyObject_GC_UnTrack(object);
    self->device.interrupted = interrupted_at_the_end;
    if (vkb_renderer_is_ours(self)) {
        self->thread = PyEval_SaveThread();
        const struct vkb_messages *before = vkb_messages_begin(&self->device.messages);
        destroy(self, &error);
        vkb_messages_end(before);
        PyEval_RestoreThread(self->thread);
    }
    self->open = false;
    // A device that is still busy or belongs to another process is not destroyed. Everything that
    // the driver may still use is kept: abandoned submissions, and this object with its messages.
    if (self->device.handle)
        return;
    vkb_renderer_release_finished(self);
    if (self->pages)
        close_memory(self, true);
    // A plan that began before close() may have made some.
    drop_transposes(self);
    if (self->lock)
        PyThread_free_lock(self->lock);
    vkb_free_object(object);
}

static PyObject *close_renderer(PyObject *object, PyObject *unused)
{
    struct vkb_renderer *self = (struct vkb_renderer *)object;
    struct vkb_error error = {0};

    (void)unused;
    if (!vkb_renderer_is_ours(self)) {
        // Forgotten here, and left as it is to the process that opened it.
        self->open = false;
        Py_RETURN_NONE;
    }
    if (!vkb_renderer_enter(self, &error))
        return vkb_raise(state_of(object), &error);
    const bool done = destroy(self, &error);
    vkb_renderer_leave(self);
    return done ? Py_NewRef(Py_None) : vkb_raise(state_of(object), &error);
}

static PyObject *pipeline_cache(PyObject *object, PyObject *unused)
{
    struct vkb_renderer *self = (struct vkb_renderer *)object;
    struct vkb_error error = {0};
    void *data = NULL;
    size_t size = 0;

    (void)unused;
    if (!vkb_renderer_enter(self, &error))
        return vkb_raise(state_of(object), &error);
    const bool done =
        vkb_require_open(self, &error)
        && vkb_pipelines_save(&self->device, &self->frame.pipelines, &data, &size, &error);
    vkb_renderer_leave(self);
    PyObject *bytes = done ? PyBytes_FromStringAndSize(data, (Py_ssize_t)size)
                           : vkb_raise(state_of(object), &error);
    vkb_free(data);
    return bytes;
}

static PyObject *get_closed(PyObject *object, void *unused)
{
    (void)unused;
    return PyBool_FromLong(!((struct vkb_renderer *)object)->open);
}

static PyObject *get_lost(PyObject *object, void *unused)
{
    (void)unused;
    return PyBool_FromLong(((const struct vkb_renderer *)object)->device.lost);
}

static PyObject *get_info(PyObject *object, void *unused)
{
    (void)unused;
    return vkb_adapter_tuple(&((struct vkb_renderer *)object)->device.adapter);
}

static PyObject *get_instance(PyObject *object, void *unused)
{
    struct vkb_renderer *self = (struct vkb_renderer *)object;
    struct vkb_error error = {0};
    void *handle = NULL;

    (void)unused;
    if (!vkb_renderer_enter(self, &error))
        return vkb_raise(state_of(object), &error);
    if (vkb_require_open(self, &error))
        handle = self->device.instance->handle;
    vkb_renderer_leave(self);
    return handle ? PyLong_FromVoidPtr(handle) : vkb_raise(state_of(object), &error);
}

static PyObject *get_transposes(PyObject *object, void *unused)
{
    struct vkb_renderer *self = (struct vkb_renderer *)object;

    (void)unused;
    VKB_LOCK(self->guard);
    const struct vkb_transposes transposes = self->transposes;
    VKB_UNLOCK(self->guard);
    return Py_BuildValue("nn", (Py_ssize_t)transposes.built, (Py_ssize_t)transposes.bytes);
}

static PyObject *get_pipeline_count(PyObject *object, void *unused)
{
    struct vkb_renderer *self = (struct vkb_renderer *)object;

    (void)unused;
    VKB_LOCK(self->guard);
    const size_t count = self->pipeline_count;
    VKB_UNLOCK(self->guard);
    return PyLong_FromSize_t(count);
}

static PyObject *get_cached(PyObject *object, void *unused)
{
    struct vkb_renderer *self = (struct vkb_renderer *)object;

    (void)unused;
    VKB_LOCK(self->guard);
    const struct vkb_cached cached = self->cached;
    VKB_UNLOCK(self->guard);
    return Py_BuildValue("(nKK)", (Py_ssize_t)cached.pipelines,
                         (unsigned long long)cached.image_bytes,
                         (unsigned long long)cached.allocations);
}

static PyMethodDef methods[] = {
    {"close", close_renderer, METH_NOARGS, "Releases the device; may be called twice."},
    {"plan", vkb_renderer_plan, METH_VARARGS,
     "plan(source, settings, names, cotangents=None, results='images', sums=()) -> Plan. Makes no "
     "device call; names None: all framebuffers. With cotangents, the names of framebuffers whose "
     "cotangents are the source's levels: of the derivatives by images, of the sums by fields "
     "('sums'; methods/adjoint.h), of both ('all'), or by the weights of a field of kernels "
     "('weights'); None if a pass has no adjoint. `sums` has the names of those that are wanted of "
     "VKB_SUMS (passes/transposes.h)."},
    {"run", vkb_renderer_run, METH_VARARGS,
     "run(source, plans, arrays, in_place=False, show=None, histories=None) -> Submission. Submits "
     "plans with the "
     "same images; arrays has a tuple for each plan, in the order of its outputs. `in_place`: the "
     "source does not change before the end of the wait, so that the device may read it where it "
     "is. `show`: (screen, width, height, linear) presents the only output on a screen, of that "
     "size if it has none of its own; `linear`: encoded as sRGB. None is returned if the surface "
     "has no image. `histories`, with one plan: what a call before has made of each framebuffer "
     "that has a history, a resident Source; None: zeros. Submission.histories has those of this "
     "call. Without `histories` all are zeros, and none is kept."},
    {"upload", vkb_renderer_upload, METH_VARARGS,
     "upload(source, spare, recycled) -> Source. A copy of an image on the device. "
     "`spare`: None, or such a source that nobody needs any more, whose memory it takes; "
     "`recycled`: it will be one."},
    {"open_screen", vkb_open_screen, METH_VARARGS,
     "open_screen(surface) -> screen, a number. Takes over a VkSurfaceKHR; 0: one without "
     "a window."},
    {"close_screen", vkb_close_screen, METH_O,
     "close_screen(screen). Waits for the device and destroys the surface, if it is still there."},
    {"pages", vkb_new_pages, METH_O,
     "pages(size) -> Pages. Memory for an array; reused when the array is gone."},
    {"cuda", vkb_renderer_cuda, METH_NOARGS,
     "cuda() -> (ordinal, stream). Opens CUDA for the renderer's GPU, if it is one of its."},
    {"cuda_name", vkb_renderer_cuda_name, METH_O, "cuda_name(ordinal) -> name and UUID."},
    {"in_context", vkb_renderer_in_context, METH_O,
     "in_context(function): what it returns, in CUDA's context of the renderer's GPU."},
    {"export", vkb_renderer_export, METH_O,
     "export(size) -> Exported. Memory of the device for an array; reused when it is gone."},
    {"snapshot", vkb_renderer_snapshot, METH_VARARGS,
     "snapshot(address, size, stream=0, later=False) -> Exported. A copy of CUDA's memory, on a "
     "stream; 0: the renderer's. `later`: it is begun by the submission that reads the copy first, "
     "or by who else does; until then CUDA's memory does not change."},
    {"pipeline_cache", pipeline_cache, METH_NOARGS, "The driver's pipeline cache as bytes."},
    {0},
};

static PyGetSetDef attributes[] = {
    {"closed", get_closed, NULL, "Whether close() was called.", NULL},
    {"lost", get_lost, NULL, "Whether the device was lost.", NULL},
    {"info", get_info, NULL, "The adapter, as adapters() describes it.", NULL},
    {"instance", get_instance, NULL, "The VkInstance, if it is open.", NULL},
    {"pipeline_count", get_pipeline_count, NULL, "Pipelines created so far.", NULL},
    {"transposes", get_transposes, NULL,
     "(computed so far, bytes that are kept) of the transposes of filters.", NULL},
    {"cached", get_cached, NULL, "(pipelines, bytes of images) that are kept for later frames.",
     NULL},
    {0},
};

// No tp_clear: abandoned submissions are kept until the device has finished them.
static int traverse(PyObject *object, visitproc visit, void *arg)
{
    const struct vkb_renderer *self = (const struct vkb_renderer *)object;

    Py_VISIT(Py_TYPE(object));
    for (const struct vkb_pending *pending = self->abandoned; pending; pending = pending->next) {
        const int result = vkb_pending_traverse(pending, visit, arg);
        if (result)
            return result;
    }
    return 0;
}

static PyType_Slot slots[] = {
    {Py_tp_new, new_renderer},
    {Py_tp_dealloc, dealloc},
    {Py_tp_traverse, traverse},
    {Py_tp_methods, methods},
    {Py_tp_getset, attributes},
    {Py_tp_doc, "A device with everything on it; vkbloom.Renderer wraps it."},
    {0},
};

PyType_Spec vkb_renderer_spec = {
    .name = "vkbloom._core.Renderer",
    .basicsize = sizeof(struct vkb_renderer),
    .flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC | Py_TPFLAGS_IMMUTABLETYPE,
    .slots = slots,
};
