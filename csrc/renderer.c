// The Renderer type: arguments in, arrays out, the GIL released around all device work.
#include "frame.h"
#include "module.h"

#include <string.h>

struct renderer {
    PyObject_HEAD
    PyThread_type_lock lock;  // held around all that touches the device
    bool open;
    struct vkb_device device;
    struct vkb_frame frame;
};

// The arrays that a call fills: held from their allocation to the end of the call.
struct held_outputs {
    struct vkb_output *outputs;
    Py_buffer *views;
    uint32_t count;
    PyObject *arrays;  // dict of name to array
};

static struct vkb_module_state *state_of(PyObject *self)
{
    return PyType_GetModuleState(Py_TYPE(self));
}

// create(adapter, validation, read_cache): read_cache(driver_uuid) gives the bytes of an earlier
// run's pipeline cache, or None.
static bool create(struct renderer *self, const char *adapter, bool validation,
                   PyObject *read_cache, struct vkb_error *error)
{
    bool done;
    const void *data = NULL;
    Py_ssize_t size = 0;

    Py_BEGIN_ALLOW_THREADS
    done = vkb_device_create(&self->device, adapter, validation, error);
    Py_END_ALLOW_THREADS
    if (!done)
        return false;
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
    const char *adapter;
    int validation;
    PyObject *read_cache;
    struct vkb_error error = {0};

    if (keywords && PyDict_Size(keywords) > 0) {
        PyErr_SetString(PyExc_TypeError, "Renderer takes no keyword arguments");
        return NULL;
    }
    if (!PyArg_ParseTuple(arguments, "spO:Renderer", &adapter, &validation, &read_cache))
        return NULL;
    allocfunc allocate = (allocfunc)PyType_GetSlot(type, Py_tp_alloc);
    struct renderer *self = (struct renderer *)allocate(type, 0);
    if (!self)
        return NULL;
    self->lock = PyThread_allocate_lock();
    if (!self->lock)
        PyErr_NoMemory();
    else
        self->open = create(self, adapter, validation, read_cache, &error);
    if (self->open)
        return (PyObject *)self;
    if (error.kind != VKB_OK)
        vkb_raise(PyType_GetModuleState(type), &error);
    Py_DECREF(self);
    return NULL;
}

// With the validation layer, an object left behind is a message here.
static bool destroy(struct renderer *self, struct vkb_error *error)
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
    struct renderer *self = (struct renderer *)object;
    PyTypeObject *type = Py_TYPE(object);
    freefunc release = (freefunc)PyType_GetSlot(type, Py_tp_free);
    struct vkb_error error = {0};

    destroy(self, &error);
    if (self->lock)
        PyThread_free_lock(self->lock);
    release(self);
    Py_DECREF(type);
}

static bool require_open(const struct renderer *self, struct vkb_error *error)
{
    if (!self->open)
        return vkb_fail(error, VKB_ERROR_VALUE, "the renderer is closed");
    if (self->device.lost)
        return vkb_fail(error, VKB_ERROR_DEVICE_LOST, "the device was lost; close the renderer");
    return true;
}

static PyObject *close_renderer(PyObject *object, PyObject *unused)
{
    struct renderer *self = (struct renderer *)object;
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

static PyObject *array_shape(const struct vkb_image_row *row, uint32_t channels)
{
    return channels == 1 ? Py_BuildValue("(II)", row->height, row->width)
                         : Py_BuildValue("(III)", row->height, row->width, channels);
}

// Asks the caller's allocate(name, shape, dtype) for the array of one framebuffer.
static bool add_output(const struct vkb_graph *graph, uint32_t image, uint32_t channels,
                       PyObject *allocate, struct held_outputs *held)
{
    const struct vkb_image_row *row = &graph->images[image];
    const struct vkb_format_info *format = &vkb_formats[row->format];
    Py_buffer *view = &held->views[held->count];
    PyObject *shape = array_shape(row, channels);
    PyObject *array =
        shape ? PyObject_CallFunction(allocate, "sOs", row->name, shape, format->dtype) : NULL;
    bool done = array && PyDict_SetItemString(held->arrays, row->name, array) == 0
             && PyObject_GetBuffer(array, view, PyBUF_WRITABLE | PyBUF_C_CONTIGUOUS) == 0;

    Py_XDECREF(shape);
    Py_XDECREF(array);
    if (!done)
        return false;
    held->outputs[held->count] = (struct vkb_output){
        .image = image,
        .channels = channels,
        .memory = view->buf,
    };
    ++held->count;
    if ((size_t)view->len == (size_t)row->width * row->height * channels * format->channel_size)
        return true;
    PyErr_Format(PyExc_ValueError, "%s: the array has the wrong size", row->name);
    return false;
}

// Whether the image is wanted: all are where `names` is None. -1 with an exception set.
static int is_wanted(PyObject *names, const char *name)
{
    if (names == Py_None)
        return 1;
    PyObject *text = PyUnicode_FromString(name);
    int wanted = text ? PySequence_Contains(names, text) : -1;
    Py_XDECREF(text);
    return wanted;
}

static bool check_names(const struct vkb_graph *graph, PyObject *names)
{
    for (Py_ssize_t i = 0, count = names == Py_None ? 0 : PyTuple_Size(names); i < count; ++i) {
        PyObject *name = PyTuple_GetItem(names, i);
        PyObject *text = PyUnicode_Check(name) ? PyUnicode_AsUTF8String(name) : NULL;
        bool found = text && vkb_graph_find(graph, PyBytes_AsString(text)) != VKB_NO_IMAGE;
        Py_XDECREF(text);
        if (found)
            continue;
        if (PyErr_Occurred())
            return false;
        char list[1024] = "";
        for (uint32_t image = 0; image < graph->image_count; ++image)
            if (graph->images[image].framebuffer && strlen(list) + VKB_NAME_SIZE + 2 < sizeof list)
                strcat(strcat(list, *list ? ", " : ""), graph->images[image].name);
        PyErr_Format(PyExc_ValueError, "attachments: there is no %R here, only %s", name, list);
        return false;
    }
    return true;
}

// Arrays for the framebuffers in the graph's order; release_outputs in any case.
static bool hold_outputs(const struct vkb_graph *graph, PyObject *names, PyObject *allocate,
                         struct held_outputs *held)
{
    struct vkb_error error;

    held->arrays = PyDict_New();
    held->outputs = vkb_alloc(&error, graph->image_count, sizeof *held->outputs);
    held->views = vkb_alloc(&error, graph->image_count, sizeof *held->views);
    if (!held->arrays || !held->outputs || !held->views) {
        if (!PyErr_Occurred())
            PyErr_NoMemory();
        return false;
    }
    if (!check_names(graph, names))
        return false;
    for (uint32_t i = 0; i < graph->image_count; ++i) {
        int wanted = graph->images[i].framebuffer ? is_wanted(names, graph->images[i].name) : 0;
        if (wanted < 0
            || (wanted && !add_output(graph, i, vkb_graph_channels(graph, i), allocate, held)))
            return false;
    }
    return true;
}

static void release_outputs(struct held_outputs *held)
{
    for (uint32_t i = 0; i < held->count; ++i)
        PyBuffer_Release(&held->views[i]);
    vkb_free(held->outputs);
    vkb_free(held->views);
    Py_XDECREF(held->arrays);
}

static PyObject *timing_dict(const struct vkb_timing *timings, uint32_t count)
{
    PyObject *dict = PyDict_New();

    for (uint32_t i = 0; dict && i < count; ++i) {
        PyObject *number = PyFloat_FromDouble(timings[i].seconds);
        if (!number || PyDict_SetItemString(dict, timings[i].name, number) < 0)
            Py_CLEAR(dict);
        Py_XDECREF(number);
    }
    return dict;
}

// Runs the graph with the GIL released; gives (arrays, timings, (NaNs, infinities of the input)).
static PyObject *run_graph(struct renderer *self, const struct vkb_graph *graph,
                           const struct vkb_frame_source *source, PyObject *names,
                           PyObject *allocate)
{
    struct held_outputs held = {0};
    struct vkb_error error = {0};
    struct vkb_timing *timings = NULL;
    uint32_t timing_count = 0;
    uint64_t nan_count = 0, inf_count = 0;
    PyObject *result = NULL, *times;
    bool done;

    if (!hold_outputs(graph, names, allocate, &held))
        goto end;
    Py_BEGIN_ALLOW_THREADS
    PyThread_acquire_lock(self->lock, WAIT_LOCK);
    done = (timings = vkb_alloc(&error, graph->pass_count, sizeof *timings))
        && require_open(self, &error)
        && vkb_frame_run(&self->device, &self->frame, source, graph, held.outputs, held.count,
                         timings, &timing_count, &error);
    if (done && source->input) {
        nan_count = self->frame.upload.nan_count;
        inf_count = self->frame.upload.inf_count;
    }
    // A validation message says more than what it led to.
    if (self->open)
        done = vkb_instance_check(&self->device.instance, &error) && done;
    PyThread_release_lock(self->lock);
    Py_END_ALLOW_THREADS
    if (!done) {
        vkb_raise(state_of((PyObject *)self), &error);
        goto end;
    }
    times = timing_dict(timings, timing_count);
    if (times)
        result = Py_BuildValue("(ON(KK))", held.arrays, times, (unsigned long long)nan_count,
                               (unsigned long long)inf_count);
end:
    vkb_free(timings);
    release_outputs(&held);
    return result;
}

static PyObject *render(PyObject *object, PyObject *arguments)
{
    struct renderer *self = (struct renderer *)object;
    PyObject *settings_object, *scene_tuple, *camera, *names, *allocate, *result = NULL;
    struct vkb_settings settings;
    struct vkb_scene_source source;
    const char *shading;
    struct vkb_graph graph = {0};
    struct vkb_held_scene scene = {0};
    struct vkb_error error = {0};

    if (!PyArg_ParseTuple(arguments, "OO!O!(II)sddOO:render", &settings_object, &PyTuple_Type,
                          &scene_tuple, &PyTuple_Type, &camera, &source.size.width,
                          &source.size.height, &shading, &source.time, &source.glow_intensity,
                          &names, &allocate))
        return NULL;
    if (!vkb_read_settings(settings_object, &settings) || !vkb_read_camera(camera, &source.camera))
        return NULL;
    if (vkb_read_scene(scene_tuple, &scene)) {
        source.has_sky = scene.data.sky.level_count > 0;
        source.has_glow = scene.data.glow.index_count > 0;
        source.has_emission = scene.data.body.emission != NULL;
        source.body_textured = scene.data.body.surface_count > 0;
        source.glow_textured = scene.data.glow.surface_count > 0;
        if (require_open(self, &error)
            && vkb_build_scene(shading, &settings, &source, &graph, &error)
            && vkb_graph_check(&graph, self->device.limits.maxFramebufferWidth, &error))
            result = run_graph(self, &graph, &(struct vkb_frame_source){.scene = &scene.data},
                               names, allocate);
        else
            vkb_raise(state_of(object), &error);
    }
    vkb_release_scene(&scene);
    vkb_graph_destroy(&graph);
    return result;
}

static PyObject *apply(PyObject *object, PyObject *arguments)
{
    struct renderer *self = (struct renderer *)object;
    PyObject *settings_object, *array, *names, *allocate, *result = NULL;
    struct vkb_settings settings;
    struct vkb_graph graph = {0};
    struct vkb_held_image image = {0};
    struct vkb_error error = {0};

    if (!PyArg_ParseTuple(arguments, "OOOO:apply", &settings_object, &array, &names, &allocate)
        || !vkb_read_settings(settings_object, &settings))
        return NULL;
    if (vkb_read_image(array, &image)) {
        const struct vkb_image_source source = {
            .format = image.input.format,
            .size = {image.input.width, image.input.height},
            .channels = image.input.channels,
        };
        if (require_open(self, &error) && vkb_build_image(&settings, &source, &graph, &error)
            && vkb_graph_check(&graph, self->device.limits.maxFramebufferWidth, &error))
            result = run_graph(self, &graph, &(struct vkb_frame_source){.input = &image.input},
                               names, allocate);
        else
            vkb_raise(state_of(object), &error);
    }
    vkb_release_image(&image);
    vkb_graph_destroy(&graph);
    return result;
}

static PyObject *pipeline_cache(PyObject *object, PyObject *unused)
{
    struct renderer *self = (struct renderer *)object;
    struct vkb_error error = {0};
    void *data = NULL;
    size_t size = 0;
    bool done;

    (void)unused;
    Py_BEGIN_ALLOW_THREADS
    PyThread_acquire_lock(self->lock, WAIT_LOCK);
    done = require_open(self, &error)
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
    return PyBool_FromLong(!((struct renderer *)object)->open);
}

static PyObject *get_info(PyObject *object, void *unused)
{
    (void)unused;
    return vkb_adapter_tuple(&((struct renderer *)object)->device.adapter);
}

static PyObject *get_pipeline_count(PyObject *object, void *unused)
{
    (void)unused;
    return PyLong_FromSize_t(((struct renderer *)object)->frame.pipelines.entry_count);
}

static PyMethodDef methods[] = {
    {"close", close_renderer, METH_NOARGS, "Gives all back; may be called twice."},
    {"render", render, METH_VARARGS,
     "render(settings, scene, camera, size, shading, time, glow_intensity, names, allocate) -> "
     "(arrays, timings, counts)"},
    {"apply", apply, METH_VARARGS,
     "apply(settings, image, names, allocate) -> (arrays, timings, counts)"},
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
    .basicsize = sizeof(struct renderer),
    .flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_IMMUTABLETYPE,
    .slots = slots,
};
