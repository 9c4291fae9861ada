// Histories: what a call continues of the one before, and what it makes for the next one. Both are
// sources with an image on the device, as uploads are, so that nothing changes one that is there: a
// call that fails leaves those before as they are, and two calls may continue from the same one.
#include "python/module.h"
#include "python/plan.h"

static struct vkb_module_state *state_of(const struct vkb_renderer *renderer)
{
    return PyType_GetModuleState(Py_TYPE((PyObject *)renderer));
}

// Whether the object is an image on the renderer's device, of the size and format of the row.
static bool check_image(const struct vkb_renderer *renderer, PyObject *object,
                        const struct vkb_image_row *row)
{
    const struct vkb_source_object *source = (struct vkb_source_object *)object;

    if (!vkb_require_type(object, state_of(renderer)->source_type, "histories")
        || !vkb_check_source(renderer, source))
        return false;
    const struct vkb_image_source *image = &source->source.image;
    if (renderer->open && !source->resident)
        return vkb_refuse("histories: an image is not on the device");
    return (image->format == row->format && image->size.width == row->width
            && image->size.height == row->height && image->channels == 4)
        || vkb_refuse("histories: an image of %u x %u in %s is given for one of %u x %u in %s",
                      image->size.width, image->size.height, vkb_formats[image->format].name,
                      row->width, row->height, vkb_formats[row->format].name);
}

bool vkb_check_histories(const struct vkb_renderer *renderer, PyObject *histories, PyObject *plans)
{
    if (histories == Py_None)
        return true;
    if (!vkb_require_tuple(histories, "histories"))
        return false;
    if (PyTuple_Size(plans) != 1)
        return vkb_refuse("histories: they are of one plan, and %zd are given",
                          PyTuple_Size(plans));
    const struct vkb_plan_object *plan = (struct vkb_plan_object *)PyTuple_GetItem(plans, 0);
    const struct vkb_graph *graph = &plan->plan.graph;
    const Py_ssize_t given = PyTuple_Size(histories);
    Py_ssize_t count = 0;

    for (uint32_t i = 0; i < graph->image_count; ++i) {
        if (!vkb_is_history(&graph->images[i]))
            continue;
        PyObject *image = count < given ? PyTuple_GetItem(histories, count) : Py_None;
        ++count;
        if (image != Py_None && !check_image(renderer, image, &graph->images[i]))
            return false;
    }
    return count == given
        || vkb_refuse("histories: %zd are given for the %zd of the plan", given, count);
}

// A source without an image, which the call gives it.
static PyObject *new_source(struct vkb_renderer *renderer, const struct vkb_image_row *row)
{
    struct vkb_source_object *self = vkb_new_object(state_of(renderer)->source_type);
    struct vkb_error error = {0};

    if (!self)
        return NULL;
    self->process = renderer->process;
    VKB_LOCK(vkb_memory);
    if (vkb_require_open(renderer, &error)) {
        self->residents = renderer->residents;
        self->resident = vkb_resident_add(renderer->residents, &error);
    }
    VKB_UNLOCK(vkb_memory);
    if (!self->resident) {
        Py_DECREF(self);
        return vkb_raise(state_of(renderer), &error);
    }
    self->source = (struct vkb_source){
        .kind = VKB_SOURCE_IMAGE,
        .image = {.format = row->format, .size = {row->width, row->height}, .channels = 4},
    };
    return (PyObject *)self;
}

PyObject *vkb_hold_histories(struct vkb_renderer *renderer, struct vkb_pending *pending,
                             PyObject *histories, struct vkb_frame_source *data)
{
    struct vkb_request *request = &pending->requests[0];
    const struct vkb_graph *graph = &request->plan->graph;
    PyObject *made = PyTuple_New(PyTuple_Size(histories));
    Py_ssize_t count = 0;

    for (uint32_t i = 0; made && i < graph->image_count; ++i) {
        if (!vkb_is_history(&graph->images[i]))
            continue;
        PyObject *before = PyTuple_GetItem(histories, count);
        PyObject *after = new_source(renderer, &graph->images[i]);
        if (before != Py_None) {
            vkb_pending_use(pending, before);
            data->histories[count] = ((struct vkb_source_object *)before)->resident;
        }
        if (after) {
            vkb_pending_use(pending, after);
            request->kept[count] = ((struct vkb_source_object *)after)->resident;
        }
        if (!vkb_set_item(made, count++, after))
            Py_CLEAR(made);
    }
    return made;
}
