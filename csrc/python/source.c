// The Source type: an image or a scene, converted once from Python objects.
#include "python/module.h"
#include "python/plan.h"

static bool read_levels(PyObject *levels, struct vkb_source_object *self)
{
    struct vkb_image_source *image = &self->source.image;
    const Py_ssize_t count = PyTuple_Size(levels);

    if (count > GATHERED_LEVELS)
        return vkb_refuse("levels: %zd images are out of range, 0 to %d", count, GATHERED_LEVELS);
    for (Py_ssize_t i = 0; i < count; ++i) {
        struct vkb_held_image *held = &self->images[VKB_INPUT_LEVEL + i];
        if (!vkb_read_image(PyTuple_GetItem(levels, i), "levels", held))
            return false;
        image->levels[image->level_count++] = (struct vkb_level){
            .format = held->input.format,
            .size = {held->input.width, held->input.height},
        };
    }
    return true;
}

// Whether a part has the size of the image and, unless it has one channel, its format and channels.
static bool check_part(const struct vkb_held_image *part, const char *name,
                       const struct vkb_held_image *image)
{
    const struct vkb_input *one = &part->input, *other = &image->input;
    const bool grey = one->channels == 1;

    return (one->width == other->width && one->height == other->height
            && one->layers == other->layers
            && (grey || (one->format == other->format && one->channels == other->channels)))
        || vkb_refuse("%s: %u x %u with %u channels of %s is not the image's, %u x %u with %u of "
                      "%s",
                      name, one->width, one->height, one->channels, vkb_formats[one->format].dtype,
                      other->width, other->height, other->channels,
                      vkb_formats[other->format].dtype);
}

// A part of one channel. False with an exception set.
static bool read_part(PyObject *part, const char *name, enum vkb_input_kind kind,
                      struct vkb_held_image *images)
{
    return part == Py_None
        || (vkb_read_grey(part, name, &images[kind])
            && check_part(&images[kind], name, &images[VKB_INPUT_IMAGE]));
}

// `emission` and `mask` may be None.
static bool read_parts(PyObject *image, PyObject *emission, PyObject *mask,
                       struct vkb_held_image *images)
{
    struct vkb_held_image *first = &images[VKB_INPUT_IMAGE];

    return vkb_read_image(image, "image", first)
        && (emission == Py_None
            || (vkb_read_image(emission, "emission", &images[VKB_INPUT_EMISSION])
                && check_part(&images[VKB_INPUT_EMISSION], "emission", first)))
        && read_part(mask, "mask", VKB_INPUT_MASK, images);
}

// Motion along x and y, and depth. Motions are both there or not.
static bool read_geometry(PyObject *const parts[3], struct vkb_held_image *images)
{
    if ((parts[0] == Py_None) != (parts[1] == Py_None))
        return vkb_refuse("motion: it has one axis and not two");
    return read_part(parts[0], "motion", VKB_INPUT_MOTION_X, images)
        && read_part(parts[1], "motion", VKB_INPUT_MOTION_Y, images)
        && read_part(parts[2], "depth", VKB_INPUT_DEPTH, images);
}

PyObject *vkb_image_source(PyObject *module, PyObject *arguments)
{
    PyObject *image, *emission = Py_None, *mask = Py_None, *levels = NULL;
    PyObject *geometry[3] = {Py_None, Py_None, Py_None};

    if (!PyArg_ParseTuple(arguments, "O|OOO!OOO:image_source", &image, &emission, &mask,
                          &PyTuple_Type, &levels, &geometry[0], &geometry[1], &geometry[2]))
        return NULL;
    struct vkb_source_object *self = vkb_new_object(vkb_module_state(module)->source_type);
    if (!self)
        return NULL;
    if (!read_parts(image, emission, mask, self->images)
        || !read_geometry(geometry, self->images)) {
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
                .layers = input->layers,
                .has_emission = emission != Py_None,
                .has_mask = mask != Py_None,
                .has_motion = geometry[0] != Py_None,
                .has_depth = geometry[2] != Py_None,
            },
    };
    if (levels && !read_levels(levels, self)) {
        Py_DECREF(self);
        return NULL;
    }
    return (PyObject *)self;
}

PyObject *vkb_scene_source(PyObject *module, PyObject *arguments)
{
    const struct vkb_module_state *state = vkb_module_state(module);
    PyObject *contents, *block;

    if (!PyArg_ParseTuple(arguments, "O!S:scene_source", state->contents_type, &contents, &block))
        return NULL;
    struct vkb_source_object *self = vkb_new_object(state->source_type);
    if (!self)
        return NULL;
    self->contents = (struct vkb_contents_object *)Py_NewRef(contents);
    if (!vkb_read_frame(block, self->contents, &self->source))
        Py_CLEAR(self);
    return (PyObject *)self;
}

bool vkb_check_source(const struct vkb_renderer *renderer, const struct vkb_source_object *source)
{
    const struct vkb_exports *exports = renderer->exports;

    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind)
        if (source->images[kind].input.exported && exports == renderer->exports)
            vkb_export_of(source->images[kind].view.obj, &exports);
    // A closed renderer says so itself.
    if (!renderer->open)
        return true;
    if (source->residents && !source->resident)
        PyErr_SetString(PyExc_ValueError, "image: another upload has taken its memory");
    else if ((source->residents && source->residents != renderer->residents)
             || exports != renderer->exports)
        PyErr_SetString(PyExc_ValueError, "image: it was uploaded to another renderer, or to one "
                                          "that is closed; upload it to this one");
    else
        return true;
    return false;
}

static bool is_exported(const struct vkb_source_object *source)
{
    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind)
        if (source->images[kind].input.exported)
            return true;
    return false;
}

// The resident image of a source that nobody needs any more, and that no submission uses; or a new
// one. With vkb_memory.
static struct vkb_resident *find_resident(struct vkb_renderer *renderer, PyObject *spare,
                                          struct vkb_error *error)
{
    struct vkb_source_object *source = (struct vkb_source_object *)spare;

    if (spare == Py_None || !source->resident || source->resident->uses > 0
        || source->residents != renderer->residents)
        return vkb_resident_add(renderer->residents, error);
    struct vkb_resident *resident = source->resident;
    source->resident = NULL;
    return resident;
}

static bool take_resident(struct vkb_renderer *renderer, PyObject *spare,
                          struct vkb_source_object *self, struct vkb_error *error)
{
    VKB_LOCK(vkb_memory);
    if (vkb_require_open(renderer, error)) {
        self->residents = renderer->residents;
        self->resident = find_resident(renderer, spare, error);
    }
    VKB_UNLOCK(vkb_memory);
    return self->resident;
}

static bool stage_all(struct vkb_renderer *renderer, struct vkb_resident *resident,
                      const struct vkb_source_object *source, struct vkb_error *error)
{
    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind)
        if (source->images[kind].view.obj
            && !vkb_resident_fill(&renderer->device, resident, kind, &source->images[kind].input,
                                  &renderer->frame.cache.clock, error))
            return false;
    return true;
}

static bool stage(struct vkb_renderer *renderer, struct vkb_resident *resident,
                  const struct vkb_source_object *source, struct vkb_error *error)
{
    if (!vkb_renderer_enter(renderer, error))
        return false;
    const bool done =
        vkb_require_open(renderer, error) && stage_all(renderer, resident, source, error);
    const bool silent = vkb_renderer_check_messages(renderer, done, error);
    vkb_renderer_leave(renderer);
    return silent;
}

// Whether the source is an image of the host, and the spare one a source or None.
static bool check_upload(const struct vkb_module_state *state,
                         const struct vkb_source_object *source, PyObject *spare)
{
    if (spare != Py_None && !vkb_require_type(spare, state->source_type, "upload"))
        return false;
    return (source->source.kind == VKB_SOURCE_IMAGE && !source->residents && !is_exported(source))
        || vkb_refuse("upload: the source is not an image of the host");
}

PyObject *vkb_renderer_upload(PyObject *object, PyObject *arguments)
{
    struct vkb_renderer *renderer = (struct vkb_renderer *)object;
    const struct vkb_module_state *state = PyType_GetModuleState(Py_TYPE(object));
    PyObject *given, *spare;
    int recycled;
    struct vkb_error error = {0};

    if (!PyArg_ParseTuple(arguments, "O!Op:upload", state->source_type, &given, &spare, &recycled))
        return NULL;
    const struct vkb_source_object *source = (struct vkb_source_object *)given;
    if (!check_upload(state, source, spare))
        return NULL;
    struct vkb_source_object *self = vkb_new_object(state->source_type);
    if (!self)
        return NULL;
    self->process = renderer->process;
    if (take_resident(renderer, spare, self, &error)) {
        self->resident->recycled = recycled;
        if (stage(renderer, self->resident, source, &error)) {
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
    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind)
        Py_VISIT(self->images[kind].view.obj);
    Py_VISIT(self->contents);
    return 0;
}

// The cleared source has no kind, so that no plan fits it.
static int clear(PyObject *object)
{
    struct vkb_source_object *self = (struct vkb_source_object *)object;

    self->source = (struct vkb_source){0};
    Py_CLEAR(self->contents);
    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind) {
        PyBuffer_Release(&self->images[kind].view);
        self->images[kind] = (struct vkb_held_image){0};
    }
    // A submission that uses it has this object, and is released first. A forked process keeps its
    // copy: the device is its parent's.
    if (self->resident && self->process == vkb_current_process()) {
        VKB_LOCK(vkb_memory);
        if (self->resident->uses == 0) {
            vkb_resident_release(self->residents, self->resident);
            self->resident = NULL;
        }
        VKB_UNLOCK(vkb_memory);
    }
    return 0;
}

static PyObject *is_resident(PyObject *object, void *unused)
{
    (void)unused;
    return PyBool_FromLong(((struct vkb_source_object *)object)->resident != NULL);
}

static PyObject *get_exported(PyObject *object, void *unused)
{
    (void)unused;
    return PyBool_FromLong(is_exported((struct vkb_source_object *)object));
}

static PyObject *get_kind(PyObject *object, void *unused)
{
    const struct vkb_image_source *image = &((struct vkb_source_object *)object)->source.image;

    (void)unused;
    return Py_BuildValue("((IIi)s)", image->size.height, image->size.width, (int)image->channels,
                         image->format == VKB_FORMAT_RGBA8_UNORM    ? "uint8"
                         : image->format == VKB_FORMAT_RGBA16_FLOAT ? "float16"
                                                                    : "float32");
}

static PyGetSetDef attributes[] = {
    {"kind", get_kind, NULL, "(shape, dtype) of an image.", NULL},
    {"exported", get_exported, NULL, "Whether an image is in memory that CUDA shares.", NULL},
    {"resident", is_resident, NULL, "Whether it is an image that stays on a device.", NULL},
    {0},
};

static PyType_Slot slots[] = {
    {Py_tp_dealloc, vkb_dealloc},
    {Py_tp_traverse, traverse},
    {Py_tp_clear, clear},
    {Py_tp_getset, attributes},
    {Py_tp_doc, "The input of frames: an image or a scene."},
    {0},
};

PyType_Spec vkb_source_spec = {
    .name = "vkbloom._core.Source",
    .basicsize = sizeof(struct vkb_source_object),
    .flags = VKB_TYPE_FLAGS | Py_TPFLAGS_HAVE_GC,
    .slots = slots,
};
