// The Batch type: points of one source, settings in, arrays out, that the device runs in one go.
// The GIL is released around all device work.
#include "python/module.h"

#include <string.h>

// What a point holds of Python's.
struct held_arrays {
    PyObject *arrays;  // dict of name to array
    Py_buffer *views;  // of the outputs
    uint32_t view_count;
};

// What the device may still write to when nobody waits for it any more.
struct batch_cargo {
    struct vkb_cargo cargo;
    struct vkb_point *points;
    struct held_arrays *held;
    size_t count;
};

struct batch {
    PyObject_HEAD
    struct vkb_renderer *renderer;
    PyObject *names;  // of the framebuffers wanted; None: all
    bool of_scene;
    const char *shading;
    PyObject *shading_object;  // whose text `shading` is
    struct vkb_scene_source scene_source;
    struct vkb_image_source image_source;
    struct vkb_held_scene scene;  // held until the submission
    struct vkb_held_image image;
    struct vkb_point *points;
    struct held_arrays *held;
    size_t count, point_capacity, held_capacity;
    size_t size;                // bytes of all arrays
    bool filling;               // a point is on its way in, while Python's code allocates
    bool submitted;             // for good
    struct vkb_flight *flight;  // NULL: not in the air
    struct batch_cargo *cargo;  // from the submission on
    struct vkb_specials specials;
};

static struct vkb_module_state *state_of(PyObject *object)
{
    return PyType_GetModuleState(Py_TYPE(object));
}

static PyObject *array_shape(const struct vkb_image_row *row, uint32_t channels)
{
    return channels == 1 ? Py_BuildValue("(II)", row->height, row->width)
                         : Py_BuildValue("(III)", row->height, row->width, channels);
}

// Asks the caller's allocate(name, shape, dtype) for the array of one framebuffer.
static bool add_output(const struct vkb_renderer *renderer, struct vkb_point *point,
                       struct held_arrays *held, uint32_t image, PyObject *allocate)
{
    const struct vkb_image_row *row = &point->graph.images[image];
    const struct vkb_format_info *format = &vkb_formats[row->format];
    const uint32_t channels = vkb_graph_channels(&point->graph, image);
    Py_buffer *view = &held->views[held->view_count];
    PyObject *shape = array_shape(row, channels);
    PyObject *array =
        shape ? PyObject_CallFunction(allocate, "sOs", row->name, shape, format->dtype) : NULL;
    bool done = array && PyDict_SetItemString(held->arrays, row->name, array) == 0
             && PyObject_GetBuffer(array, view, PyBUF_WRITABLE | PyBUF_C_CONTIGUOUS) == 0;

    Py_XDECREF(shape);
    Py_XDECREF(array);
    if (!done)
        return false;
    ++held->view_count;
    point->outputs[point->output_count++] = (struct vkb_output){
        .image = image,
        .channels = channels,
        .memory = view->buf,
        // (Whoever keeps many arrays shall not pay for each small one.)
        .pages = view->len >= VKB_IMPORTED_BYTES ? vkb_array_pages(renderer, view->buf) : NULL,
    };
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

// Arrays for the framebuffers in the graph's order.
static bool hold_outputs(const struct vkb_renderer *renderer, struct vkb_point *point,
                         struct held_arrays *held, PyObject *names, PyObject *allocate)
{
    const struct vkb_graph *graph = &point->graph;
    struct vkb_error error;

    held->arrays = PyDict_New();
    point->outputs = vkb_alloc(&error, graph->image_count, sizeof *point->outputs);
    point->timings = vkb_alloc(&error, graph->pass_count, sizeof *point->timings);
    held->views = vkb_alloc(&error, graph->image_count, sizeof *held->views);
    if (!held->arrays || !point->outputs || !point->timings || !held->views) {
        if (!PyErr_Occurred())
            PyErr_NoMemory();
        return false;
    }
    if (!check_names(graph, names))
        return false;
    for (uint32_t i = 0; i < graph->image_count; ++i) {
        int wanted = graph->images[i].framebuffer ? is_wanted(names, graph->images[i].name) : 0;
        if (wanted < 0 || (wanted && !add_output(renderer, point, held, i, allocate)))
            return false;
    }
    return true;
}

static void release_views(struct held_arrays *held)
{
    while (held->view_count > 0)
        PyBuffer_Release(&held->views[--held->view_count]);
}

// Gives back the half-built or whole point.
static void release_point(struct vkb_point *point, struct held_arrays *held)
{
    release_views(held);
    vkb_free(held->views);
    Py_XDECREF(held->arrays);
    vkb_free(point->outputs);
    vkb_free(point->timings);
    vkb_graph_destroy(&point->graph);
}

static void release_source(struct batch *self)
{
    vkb_release_scene(&self->scene);
    vkb_release_image(&self->image);
}

static struct batch *new_batch(PyObject *renderer, PyObject *names)
{
    if (names != Py_None && !vkb_require_tuple(names, "attachments"))
        return NULL;
    PyTypeObject *type = (PyTypeObject *)state_of(renderer)->batch_type;
    allocfunc allocate = (allocfunc)PyType_GetSlot(type, Py_tp_alloc);
    struct batch *self = (struct batch *)allocate(type, 0);

    if (self) {
        self->renderer = (struct vkb_renderer *)Py_NewRef(renderer);
        self->names = Py_NewRef(names);
    }
    return self;
}

PyObject *vkb_batch_of_scene(PyObject *renderer, PyObject *arguments)
{
    PyObject *scene_tuple, *camera, *names, *shading;
    struct vkb_scene_source source = {0};

    if (!PyArg_ParseTuple(arguments, "O!O!(O&O&)OddO:render", &PyTuple_Type, &scene_tuple,
                          &PyTuple_Type, &camera, vkb_read_uint32, &source.size.width,
                          vkb_read_uint32, &source.size.height, &shading, &source.time,
                          &source.glow_intensity, &names)
        || !vkb_read_camera(camera, &source.camera))
        return NULL;
    struct batch *self = new_batch(renderer, names);
    if (!self)
        return NULL;
    self->of_scene = true;
    self->shading_object = PyUnicode_AsUTF8String(shading);
    self->shading = self->shading_object ? PyBytes_AsString(self->shading_object) : NULL;
    if (!self->shading || !vkb_read_scene(scene_tuple, &self->scene)) {
        Py_DECREF(self);
        return NULL;
    }
    source.has_sky = self->scene.data.sky.level_count > 0;
    source.has_glow = self->scene.data.glow.index_count > 0;
    source.has_emission = self->scene.data.body.emission != NULL;
    source.body_textured = self->scene.data.body.surface_count > 0;
    source.glow_textured = self->scene.data.glow.surface_count > 0;
    self->scene_source = source;
    return (PyObject *)self;
}

PyObject *vkb_batch_of_image(PyObject *renderer, PyObject *arguments)
{
    PyObject *array, *names;

    if (!PyArg_ParseTuple(arguments, "OO:apply", &array, &names))
        return NULL;
    struct batch *self = new_batch(renderer, names);
    if (!self)
        return NULL;
    if (!vkb_read_image(array, &self->image)) {
        Py_DECREF(self);
        return NULL;
    }
    self->image_source = (struct vkb_image_source){
        .format = self->image.input.format,
        .size = {self->image.input.width, self->image.input.height},
        .channels = self->image.input.channels,
    };
    return (PyObject *)self;
}

static void release_points(struct vkb_point *points, struct held_arrays *held, size_t count)
{
    for (size_t i = 0; i < count; ++i)
        release_point(&points[i], &held[i]);
    vkb_free(points);
    vkb_free(held);
}

static void release_cargo(struct vkb_cargo *cargo)
{
    struct batch_cargo *self = (struct batch_cargo *)cargo;

    release_points(self->points, self->held, self->count);
    vkb_free(self);
}

// Leaves the points to the renderer until the device, which may write to their arrays, is done.
static void set_adrift(struct batch *self, struct vkb_flight *flight)
{
    *self->cargo = (struct batch_cargo){
        .cargo = {.flight = flight, .release = release_cargo},
        .points = self->points,
        .held = self->held,
        .count = self->count,
    };
    vkb_renderer_set_adrift(self->renderer, &self->cargo->cargo);
    self->cargo = NULL;
    self->points = NULL;
    self->held = NULL;
    self->count = 0;
}

static void dealloc(PyObject *object)
{
    struct batch *self = (struct batch *)object;
    PyTypeObject *type = Py_TYPE(object);
    freefunc release = (freefunc)PyType_GetSlot(type, Py_tp_free);

    // A forked process has no device that could write.
    if (self->flight && vkb_renderer_is_ours(self->renderer))
        set_adrift(self, self->flight);
    release_source(self);
    release_points(self->points, self->held, self->count);
    vkb_free(self->cargo);
    Py_XDECREF(self->shading_object);
    Py_XDECREF(self->names);
    Py_XDECREF((PyObject *)self->renderer);
    release(self);
    Py_DECREF(type);
}

static bool build_graph(const struct batch *self, const struct vkb_settings *settings,
                        struct vkb_graph *graph, struct vkb_error *error)
{
    const struct vkb_device *device = &self->renderer->device;

    const bool built =
        self->of_scene
            ? vkb_check_sizes(settings, "size", self->scene_source.size, device->max_side, error)
                  && vkb_build_scene(self->shading, settings, &self->scene_source, graph, error)
            : vkb_check_sizes(settings, "image", self->image_source.size, device->max_side, error)
                  && vkb_build_image(settings, &self->image_source, graph, error);

    return built && vkb_forms_choose(self->renderer->forms, device, graph, error)
        && vkb_graph_check(graph, device->max_side, error) && vkb_slots_check(device, graph, error);
}

// Whether points can be added and the batch submitted; else with an exception set.
static bool require_fillable(const struct batch *self)
{
    if (self->submitted)
        PyErr_SetString(PyExc_RuntimeError, "the batch was submitted before");
    else if (self->filling)
        PyErr_SetString(PyExc_RuntimeError, "a point is being added to the batch");
    return !self->submitted && !self->filling;
}

static PyObject *add(PyObject *object, PyObject *arguments)
{
    struct batch *self = (struct batch *)object;
    PyObject *settings_object, *allocate;
    struct vkb_settings settings;
    struct vkb_error error = {0};
    struct vkb_point point = {0};
    struct held_arrays held = {0};

    // Reading settings runs Python's code, so what that may have done is asked after it.
    if (!PyArg_ParseTuple(arguments, "OO:add", &settings_object, &allocate)
        || !vkb_read_settings(state_of(object), settings_object, &settings)
        || !require_fillable(self))
        return NULL;
    if (!vkb_require_open(self->renderer, &error)
        || !vkb_grow(&error, &self->points, &self->point_capacity, self->count + 1,
                     sizeof *self->points)
        || !vkb_grow(&error, &self->held, &self->held_capacity, self->count + 1, sizeof *self->held)
        || !build_graph(self, &settings, &point.graph, &error)) {
        vkb_graph_destroy(&point.graph);
        return vkb_raise(state_of(object), &error);
    }
    if (self->count > 0 && !vkb_graph_same_images(&self->points[0].graph, &point.graph)) {
        vkb_graph_destroy(&point.graph);
        Py_RETURN_FALSE;
    }
    self->filling = true;
    const bool done = hold_outputs(self->renderer, &point, &held, self->names, allocate);
    self->filling = false;
    if (!done) {
        release_point(&point, &held);
        return NULL;
    }
    for (uint32_t i = 0; i < held.view_count; ++i)
        self->size += (size_t)held.views[i].len;
    self->points[self->count] = point;
    self->held[self->count++] = held;
    Py_RETURN_TRUE;
}

static PyObject *submit(PyObject *object, PyObject *unused)
{
    struct batch *self = (struct batch *)object;
    struct vkb_renderer *renderer = self->renderer;
    const struct vkb_frame_source source = {
        .scene = self->of_scene ? &self->scene.data : NULL,
        .input = self->of_scene ? NULL : &self->image.input,
    };
    struct vkb_error error = {0};
    bool done;

    (void)unused;
    if (!require_fillable(self))
        return NULL;
    if (self->count == 0) {
        PyErr_SetString(PyExc_RuntimeError, "a batch without points cannot be submitted");
        return NULL;
    }
    self->submitted = true;
    self->cargo = vkb_alloc(&error, 1, sizeof *self->cargo);
    if (!self->cargo || !vkb_renderer_enter(renderer, &error)) {
        release_source(self);
        return vkb_raise(state_of(object), &error);
    }
    done = vkb_require_open(renderer, &error)
        && vkb_frame_submit(&renderer->device, &renderer->frame, &source, self->points,
                            (uint32_t)self->count, &self->flight, &error);
    if (done && source.input)
        self->specials = renderer->frame.upload.specials;
    done = vkb_renderer_check_messages(renderer, done, &error);
    vkb_renderer_leave(renderer);
    release_source(self);
    return done ? Py_NewRef(Py_None) : vkb_raise(state_of(object), &error);
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

// [(arrays, timings, (NaNs, infinities of the input)), ...]
static PyObject *results(const struct batch *self)
{
    PyObject *list = PyList_New((Py_ssize_t)self->count);

    for (size_t i = 0; list && i < self->count; ++i) {
        const struct vkb_point *point = &self->points[i];
        PyObject *times = timing_dict(point->timings, point->timing_count);
        PyObject *result = times ? Py_BuildValue("(ON(KK))", self->held[i].arrays, times,
                                                 (unsigned long long)self->specials.nan,
                                                 (unsigned long long)self->specials.inf)
                                 : NULL;
        if (!result || PyList_SetItem(list, (Py_ssize_t)i, result) < 0)
            Py_CLEAR(list);
    }
    return list;
}

static PyObject *refuse_to_collect(void)
{
    PyErr_SetString(PyExc_RuntimeError, "a batch is collected once, after its submission");
    return NULL;
}

static PyObject *collect(PyObject *object, PyObject *unused)
{
    struct batch *self = (struct batch *)object;
    struct vkb_renderer *renderer = self->renderer;
    struct vkb_flight *flight;
    struct vkb_error error = {0};
    bool done, over = true;

    (void)unused;
    if (!self->flight)
        return refuse_to_collect();
    if (!vkb_renderer_enter(renderer, &error))
        return vkb_raise(state_of(object), &error);
    // Another thread may have had it since it was asked for.
    flight = self->flight;
    self->flight = NULL;
    if (!flight) {
        vkb_renderer_leave(renderer);
        return refuse_to_collect();
    }
    // A closed renderer has no flights.
    done = renderer->open
             ? vkb_frame_collect(&renderer->device, &renderer->frame, flight, &over, &error)
             : vkb_require_open(renderer, &error);
    done = vkb_renderer_check_messages(renderer, done, &error);
    vkb_renderer_leave(renderer);
    if (!over) {
        set_adrift(self, flight);
        return vkb_raise(state_of(object), &error);
    }
    for (size_t i = 0; i < self->count; ++i)
        release_views(&self->held[i]);
    return done ? results(self) : vkb_raise(state_of(object), &error);
}

static PyObject *get_size(PyObject *object, void *unused)
{
    (void)unused;
    return PyLong_FromSize_t(((struct batch *)object)->size);
}

static PyMethodDef methods[] = {
    {"add", add, METH_VARARGS,
     "add(settings, allocate) -> bool. One more point; False where its images are others than "
     "those "
     "of the points before it: it needs another batch."},
    {"submit", submit, METH_NOARGS, "Hands the points to the device."},
    {"collect", collect, METH_NOARGS,
     "collect() -> [(arrays, timings, counts), ...]. Waits for the points."},
    {0},
};

static PyGetSetDef attributes[] = {
    {"size", get_size, NULL, "Bytes of the arrays of all points.", NULL},
    {0},
};

static PyType_Slot slots[] = {
    {Py_tp_dealloc, dealloc},
    {Py_tp_methods, methods},
    {Py_tp_getset, attributes},
    {Py_tp_doc, "Points of one source that the device runs in one go."},
    {0},
};

PyType_Spec vkb_batch_spec = {
    .name = "vkbloom._core.Batch",
    .basicsize = sizeof(struct batch),
    .flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_IMMUTABLETYPE | Py_TPFLAGS_DISALLOW_INSTANTIATION,
    .slots = slots,
};
