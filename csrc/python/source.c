// The Source type: what frames are made from, an image or a scene, read once from Python's objects.
#include "python/module.h"

#include <stdio.h>

static struct vkb_source_object *new_source(PyObject *module)
{
    PyTypeObject *type = (PyTypeObject *)vkb_module_state(module)->source_type;
    allocfunc allocate = (allocfunc)PyType_GetSlot(type, Py_tp_alloc);

    return (struct vkb_source_object *)allocate(type, 0);
}

PyObject *vkb_image_source(PyObject *module, PyObject *array)
{
    struct vkb_source_object *self = new_source(module);

    if (!self)
        return NULL;
    if (!vkb_read_image(array, &self->image)) {
        Py_DECREF(self);
        return NULL;
    }
    self->source = (struct vkb_source){
        .kind = VKB_SOURCE_IMAGE,
        .image =
            {
                .format = self->image.input.format,
                .size = {self->image.input.width, self->image.input.height},
                .channels = self->image.input.channels,
            },
    };
    return (PyObject *)self;
}

static bool read_shading(PyObject *object, struct vkb_source *source)
{
    PyObject *text = PyUnicode_AsUTF8String(object);

    if (!text)
        return false;
    snprintf(source->shading, sizeof source->shading, "%s", PyBytes_AsString(text));
    Py_DECREF(text);
    return true;
}

PyObject *vkb_scene_source(PyObject *module, PyObject *arguments)
{
    PyObject *scene_tuple, *camera, *shading;
    struct vkb_source source = {.kind = VKB_SOURCE_SCENE};
    struct vkb_scene_source *scene = &source.scene;

    if (!PyArg_ParseTuple(arguments, "O!O!(O&O&)Odd:scene_source", &PyTuple_Type, &scene_tuple,
                          &PyTuple_Type, &camera, vkb_read_uint32, &scene->size.width,
                          vkb_read_uint32, &scene->size.height, &shading, &scene->time,
                          &scene->glow_intensity)
        || !vkb_read_camera(camera, &scene->camera) || !read_shading(shading, &source))
        return NULL;
    struct vkb_source_object *self = new_source(module);
    if (!self)
        return NULL;
    if (!vkb_read_scene(scene_tuple, &self->scene)) {
        Py_DECREF(self);
        return NULL;
    }
    const struct vkb_scene_data *data = &self->scene.data;
    scene->has_sky = data->sky.level_count > 0;
    scene->has_glow = data->glow.index_count > 0;
    scene->has_emission = data->body.emission != NULL;
    scene->body_textured = data->body.surface_count > 0;
    scene->glow_textured = data->glow.surface_count > 0;
    self->source = source;
    return (PyObject *)self;
}

bool vkb_check_source(const struct vkb_renderer *renderer, const struct vkb_source_object *source)
{
    // A closed renderer says so itself.
    if (!source->resident || !renderer->open || source->residents == renderer->residents)
        return true;
    PyErr_SetString(PyExc_ValueError, "image: it was uploaded to another renderer, or to one that "
                                      "is closed; upload it to this one");
    return false;
}

// The resident image of a source that nobody needs any more, and that no submission uses; or a new
// one.
static struct vkb_resident *take_resident(struct vkb_renderer *renderer, PyObject *spare,
                                          struct vkb_error *error)
{
    struct vkb_source_object *source = (struct vkb_source_object *)spare;

    if (spare == Py_None || !source->resident || source->resident->uses > 0
        || source->residents != renderer->residents)
        return vkb_resident_add(renderer->residents, error);
    struct vkb_resident *resident = source->resident;
    source->resident = NULL;
    source->source = (struct vkb_source){0};
    return resident;
}

static bool stage(struct vkb_renderer *renderer, struct vkb_resident *resident,
                  const struct vkb_input *input, struct vkb_error *error)
{
    if (!vkb_renderer_enter(renderer, error))
        return false;
    const bool done = vkb_require_open(renderer, error)
                   && vkb_resident_stage(&renderer->device, resident, input,
                                         &renderer->frame.cache.clock, error);
    const bool silent = vkb_renderer_check_messages(renderer, done, error);
    vkb_renderer_leave(renderer);
    return silent;
}

PyObject *vkb_renderer_upload(PyObject *object, PyObject *arguments)
{
    struct vkb_renderer *renderer = (struct vkb_renderer *)object;
    const struct vkb_module_state *state = PyType_GetModuleState(Py_TYPE(object));
    PyTypeObject *type = (PyTypeObject *)state->source_type;
    PyObject *given, *spare;
    int recycled;
    struct vkb_error error = {0};

    if (!PyArg_ParseTuple(arguments, "O!Op:upload", type, &given, &spare, &recycled))
        return NULL;
    const struct vkb_source_object *source = (struct vkb_source_object *)given;
    if (!source->image.held || (spare != Py_None && !PyObject_TypeCheck(spare, type))) {
        PyErr_SetString(PyExc_ValueError, "upload: an image in host memory is needed");
        return NULL;
    }
    if (!vkb_require_open(renderer, &error))
        return vkb_raise(state, &error);
    allocfunc allocate = (allocfunc)PyType_GetSlot(type, Py_tp_alloc);
    struct vkb_source_object *self = (struct vkb_source_object *)allocate(type, 0);
    if (!self)
        return NULL;
    self->residents = renderer->residents;
    self->process = renderer->process;
    self->resident = take_resident(renderer, spare, &error);
    if (self->resident) {
        self->resident->recycled = recycled;
        if (stage(renderer, self->resident, &source->image.input, &error)) {
            self->source = source->source;
            return (PyObject *)self;
        }
    }
    Py_DECREF(self);
    return vkb_raise(state, &error);
}

static int traverse(PyObject *object, visitproc visit, void *arg)
{
    struct vkb_source_object *self = (struct vkb_source_object *)object;

    Py_VISIT(Py_TYPE(object));
    if (self->image.held)
        Py_VISIT(self->image.view.obj);
    for (size_t i = 0; i < self->scene.view_count; ++i)
        Py_VISIT(self->scene.views[i].obj);
    return 0;
}

// What is left is of no kind, so that nothing runs on it.
static int clear(PyObject *object)
{
    struct vkb_source_object *self = (struct vkb_source_object *)object;

    self->source = (struct vkb_source){0};
    vkb_release_scene(&self->scene);
    vkb_release_image(&self->image);
    // A submission that uses it has this object, and is released first. A forked process keeps its
    // copy: the device is its parent's.
    if (self->resident && self->resident->uses > 0)
        return 0;
    if (self->resident && self->process == vkb_current_process())
        vkb_resident_release(self->residents, self->resident);
    self->resident = NULL;
    return 0;
}

static void dealloc(PyObject *object)
{
    PyTypeObject *type = Py_TYPE(object);
    freefunc release = (freefunc)PyType_GetSlot(type, Py_tp_free);

    PyObject_GC_UnTrack(object);
    clear(object);
    release(object);
    Py_DECREF(type);
}

static PyObject *is_resident(PyObject *object, void *unused)
{
    (void)unused;
    return PyBool_FromLong(((struct vkb_source_object *)object)->resident != NULL);
}

static PyGetSetDef attributes[] = {
    {"resident", is_resident, NULL, "Whether it is an image that stays on a device.", NULL},
    {0},
};

static PyType_Slot slots[] = {
    {Py_tp_dealloc, dealloc},
    {Py_tp_traverse, traverse},
    {Py_tp_clear, clear},
    {Py_tp_getset, attributes},
    {Py_tp_doc, "What frames are made from: an image or a scene."},
    {0},
};

PyType_Spec vkb_source_spec = {
    .name = "vkbloom._core.Source",
    .basicsize = sizeof(struct vkb_source_object),
    .flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC | Py_TPFLAGS_IMMUTABLETYPE
           | Py_TPFLAGS_DISALLOW_INSTANTIATION,
    .slots = slots,
};
