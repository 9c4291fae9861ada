// The Source type: what frames are made from, an image or a scene, read once from Python's objects.
#include "python/module.h"

#include <stdio.h>

static struct vkb_source_object *new_source(PyObject *module)
{
    PyTypeObject *type = (PyTypeObject *)vkb_module_state(module)->source_type;
    allocfunc allocate = (allocfunc)PyType_GetSlot(type, Py_tp_alloc);

    return (struct vkb_source_object *)allocate(type, 0);
}

// Whether what accompanies the image fits it; one that is not there does.
static bool fits_image(const struct vkb_source_object *self, enum vkb_input_kind kind)
{
    const struct vkb_input *image = &self->images[VKB_INPUT_IMAGE].input;
    const struct vkb_input *other = &self->images[kind].input;

    if (!self->images[kind].held
        || (other->width == image->width && other->height == image->height
            && (kind == VKB_INPUT_MASK
                || (other->format == image->format && other->channels == image->channels))))
        return true;
    if (kind == VKB_INPUT_MASK)
        PyErr_SetString(PyExc_ValueError, "mask: it does not have the image's size");
    else
        PyErr_SetString(PyExc_ValueError, "emission: it does not have the image's shape and dtype");
    return false;
}

PyObject *vkb_image_source(PyObject *module, PyObject *arguments)
{
    PyObject *image, *emission = Py_None, *mask = Py_None;

    if (!PyArg_ParseTuple(arguments, "O|OO:image_source", &image, &emission, &mask))
        return NULL;
    struct vkb_source_object *self = new_source(module);
    if (!self)
        return NULL;
    if (!vkb_read_image(image, "image", &self->images[VKB_INPUT_IMAGE])
        || (emission != Py_None
            && !vkb_read_image(emission, "emission", &self->images[VKB_INPUT_EMISSION]))
        || (mask != Py_None && !vkb_read_mask(mask, &self->images[VKB_INPUT_MASK]))
        || !fits_image(self, VKB_INPUT_EMISSION) || !fits_image(self, VKB_INPUT_MASK)) {
        Py_DECREF(self);
        return NULL;
    }
    const struct vkb_input *input = &self->images[VKB_INPUT_IMAGE].input;
    self->source = (struct vkb_source){
        .kind = VKB_SOURCE_IMAGE,
        .image =
            {
                .format = input->format,
                .size = {input->width, input->height},
                .channels = input->channels,
                .has_emission = emission != Py_None,
                .has_mask = mask != Py_None,
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

static int traverse(PyObject *object, visitproc visit, void *arg)
{
    struct vkb_source_object *self = (struct vkb_source_object *)object;

    Py_VISIT(Py_TYPE(object));
    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind)
        if (self->images[kind].held)
            Py_VISIT(self->images[kind].view.obj);
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
    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind)
        vkb_release_image(&self->images[kind]);
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

static PyType_Slot slots[] = {
    {Py_tp_dealloc, dealloc},
    {Py_tp_traverse, traverse},
    {Py_tp_clear, clear},
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
