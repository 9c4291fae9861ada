// The Renderer type: a device and all that lives on it.
#include "module.h"

static struct vkb_module_state *state_of(PyObject *self)
{
    return PyType_GetModuleState(Py_TYPE(self));
}

// create(adapter, validation, forms, read_cache): read_cache(driver_uuid) gives the bytes of an
// earlier run's pipeline cache, or None.
static bool create(struct vkb_renderer *self, const char *adapter, bool validation,
                   const char *forms, PyObject *read_cache, struct vkb_error *error)
{
    bool done;
    const void *data = NULL;
    Py_ssize_t size = 0;

    Py_BEGIN_ALLOW_THREADS
    done = vkb_device_create(&self->device, adapter, validation, error);
    Py_END_ALLOW_THREADS
    if (!done)
        return false;
    self->forms = vkb_forms_by_name(forms, &self->device);
    if (self->forms == VKB_FORMS_COUNT) {
        vkb_device_destroy(&self->device);
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "VKBLOOM_FORM: %s is not one of auto, fragment, cpu, gpu", forms);
    }
    PyObject *cache = PyObject_CallFunction(read_cache, "y#", self->device.adapter.driver_uuid,
                                            (Py_ssize_t)VK_UUID_SIZE);
    if (cache && cache != Py_None && PyBytes_AsStringAndSize(cache, (char **)&data, &size) < 0)
        Py_CLEAR(cache);
    if (!cache) {
        vkb_device_destroy(&self->device);
        return false;
    }
    Py_BEGIN_ALLOW_THREADS
    done = vkb_frame_create(&self->device, data, (size_t)size, &self->frame, error)
        && vkb_instance_check(&self->device.instance, error);
    if (!done) {
        vkb_frame_destroy(&self->device, &self->frame);
        vkb_device_destroy(&self->device);
    }
    Py_END_ALLOW_THREADS
    Py_DECREF(cache);
    return done;
}

static PyObject *new_renderer(PyTypeObject *type, PyObject *arguments, PyObject *keywords)
{
    const char *adapter, *forms;
    int validation;
    PyObject *read_cache;
    struct vkb_error error = {0};

    if (keywords && PyDict_Size(keywords) > 0) {
        PyErr_SetString(PyExc_TypeError, "Renderer takes no keyword arguments");
        return NULL;
    }
    if (!PyArg_ParseTuple(arguments, "spsO:Renderer", &adapter, &validation, &forms, &read_cache))
        return NULL;
    allocfunc allocate = (allocfunc)PyType_GetSlot(type, Py_tp_alloc);
    struct vkb_renderer *self = (struct vkb_renderer *)allocate(type, 0);
    if (!self)
        return NULL;
    self->lock = PyThread_allocate_lock();
    if (!self->lock)
        PyErr_NoMemory();
    else
        self->open = create(self, adapter, validation, forms, read_cache, &error);
    if (self->open)
        return (PyObject *)self;
    if (error.kind != VKB_OK)
        vkb_raise(PyType_GetModuleState(type), &error);
    Py_DECREF(self);
    return NULL;
}

// With the validation layer, an object left behind is a message here.
static bool destroy(struct vkb_renderer *self, struct vkb_error *error)
{
    if (!self->open)
        return true;
    self->open = false;
    vkb_frame_destroy(&self->device, &self->frame);
    // The instance stays readable after its end: the messages are the renderer's own memory.
    vkb_device_destroy(&self->device);
    return vkb_instance_check(&self->device.instance, error);
}

static void dealloc(PyObject *object)
{
    struct vkb_renderer *self = (struct vkb_renderer *)object;
    PyTypeObject *type = Py_TYPE(object);
    freefunc release = (freefunc)PyType_GetSlot(type, Py_tp_free);
    struct vkb_error error = {0};

    destroy(self, &error);
    if (self->lock)
        PyThread_free_lock(self->lock);
    release(self);
    Py_DECREF(type);
}

bool vkb_require_open(const struct vkb_renderer *self, struct vkb_error *error)
{
    if (!self->open)
        return vkb_fail(error, VKB_ERROR_VALUE, "the renderer is closed");
    if (self->device.lost)
        return vkb_fail(error, VKB_ERROR_DEVICE_LOST, "the device was lost; close the renderer");
    return true;
}

static PyObject *close_renderer(PyObject *object, PyObject *unused)
{
    struct vkb_renderer *self = (struct vkb_renderer *)object;
    struct vkb_error error = {0};
    bool done;

    (void)unused;
    Py_BEGIN_ALLOW_THREADS
    PyThread_acquire_lock(self->lock, WAIT_LOCK);
    done = destroy(self, &error);
    PyThread_release_lock(self->lock);
    Py_END_ALLOW_THREADS
    return done ? Py_NewRef(Py_None) : vkb_raise(state_of(object), &error);
}

static PyObject *pipeline_cache(PyObject *object, PyObject *unused)
{
    struct vkb_renderer *self = (struct vkb_renderer *)object;
    struct vkb_error error = {0};
    void *data = NULL;
    size_t size = 0;
    bool done;

    (void)unused;
    Py_BEGIN_ALLOW_THREADS
    PyThread_acquire_lock(self->lock, WAIT_LOCK);
    done = vkb_require_open(self, &error)
        && vkb_pipelines_save(&self->device, &self->frame.pipelines, &data, &size, &error);
    PyThread_release_lock(self->lock);
    Py_END_ALLOW_THREADS
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

static PyObject *get_info(PyObject *object, void *unused)
{
    (void)unused;
    return vkb_adapter_tuple(&((struct vkb_renderer *)object)->device.adapter);
}

static PyObject *get_pipeline_count(PyObject *object, void *unused)
{
    (void)unused;
    return PyLong_FromSize_t(((struct vkb_renderer *)object)->frame.pipelines.entry_count);
}

static PyMethodDef methods[] = {
    {"close", close_renderer, METH_NOARGS, "Gives all back; may be called twice."},
    {"render", vkb_batch_of_scene, METH_VARARGS,
     "render(scene, camera, size, shading, time, glow_intensity, names) -> Batch"},
    {"apply", vkb_batch_of_image, METH_VARARGS, "apply(image, names) -> Batch"},
    {"pipeline_cache", pipeline_cache, METH_NOARGS, "The driver's pipeline cache as bytes."},
    {0},
};

static PyGetSetDef attributes[] = {
    {"closed", get_closed, NULL, "Whether close() was called.", NULL},
    {"info", get_info, NULL, "The adapter, as adapters() describes it.", NULL},
    {"pipeline_count", get_pipeline_count, NULL, "Pipelines created so far.", NULL},
    {0},
};

static PyType_Slot slots[] = {
    {Py_tp_new, new_renderer},
    {Py_tp_dealloc, dealloc},
    {Py_tp_methods, methods},
    {Py_tp_getset, attributes},
    {Py_tp_doc, "A device and all that lives on it; vkbloom.Renderer wraps it."},
    {0},
};

PyType_Spec vkb_renderer_spec = {
    .name = "vkbloom._core.Renderer",
    .basicsize = sizeof(struct vkb_renderer),
    .flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_IMMUTABLETYPE,
    .slots = slots,
};
