// The Source type: an image or a scene, converted once from Python objects.
#include "python/module.h"

#include <stdio.h>

PyObject *vkb_image_source(PyObject *module, PyObject *array)
{
    struct vkb_source_object *self = vkb_new_object(vkb_module_state(module)->source_type);

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
    struct vkb_source_object *self = vkb_new_object(vkb_module_state(module)->source_type);
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
    if (self->image.held)
        Py_VISIT(self->image.view.obj);
    for (size_t i = 0; i < self->scene.view_count; ++i)
        Py_VISIT(self->scene.views[i].obj);
    return 0;
}

// The cleared source has no kind, so that no plan fits it.
static int clear(PyObject *object)
{
    struct vkb_source_object *self = (struct vkb_source_object *)object;

    self->source = (struct vkb_source){0};
    vkb_release_scene(&self->scene);
    vkb_release_image(&self->image);
    return 0;
}

static void dealloc(PyObject *object)
{
    PyObject_GC_UnTrack(object);
    clear(object);
    vkb_free_object(object);
}

static PyType_Slot slots[] = {
    {Py_tp_dealloc, dealloc},
    {Py_tp_traverse, traverse},
    {Py_tp_clear, clear},
    {Py_tp_doc, "The input of frames: an image or a scene."},
    {0},
};

PyType_Spec vkb_source_spec = {
    .name = "vkbloom._core.Source",
    .basicsize = sizeof(struct vkb_source_object),
    .flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC | Py_TPFLAGS_IMMUTABLETYPE
           | Py_TPFLAGS_DISALLOW_INSTANTIATION,
    .slots = slots,
};
