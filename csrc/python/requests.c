// Plans run on a renderer: the Submission type. The GIL is released around all device work.
#include "python/arguments.h"
#include "python/module.h"
#include "python/plan.h"

#include "execute/limits.h"
#include "execute/transient.h"

#include <string.h>

struct submission {
    PyObject_HEAD
    struct vkb_renderer *renderer;
    VKB_ATOMIC(struct vkb_pending *) pending;  // NULL: finished or abandoned
    PyObject *histories;                       // a tuple of Sources; NULL: none is kept
    bool taken;                                // a call of wait has it; accessed with the lock
};

static struct vkb_module_state *state_of(PyObject *object)
{
    return PyType_GetModuleState(Py_TYPE(object));
}

static const struct vkb_plan_object *plan_at(PyObject *plans, Py_ssize_t index)
{
    return (const struct vkb_plan_object *)PyTuple_GetItem(plans, index);
}

// Allocates the memory that the requests need in addition to their plans.
static struct vkb_pending *new_pending(PyObject *source, PyObject *plans, struct vkb_error *error)
{
    struct vkb_pending *pending = vkb_alloc(error, 1, sizeof *pending);
    const Py_ssize_t count = PyTuple_Size(plans);
    // All plans of a batch have the same layers.
    const uint32_t layers = plan_at(plans, 0)->plan.graph.layers;
    size_t output_count = 0, pass_count = 0;

    if (!pending)
        return NULL;
    for (Py_ssize_t i = 0; i < count; ++i) {
        output_count += plan_at(plans, i)->plan.output_count;
        pass_count += plan_at(plans, i)->plan.graph.pass_count;
    }
    pending->plans = Py_NewRef(plans);
    vkb_pending_use(pending, source);
    pending->requests = vkb_alloc(error, (size_t)count, sizeof *pending->requests);
    pending->outputs = vkb_alloc(error, output_count, sizeof *pending->outputs);
    pending->views = vkb_alloc(error, output_count, sizeof *pending->views);
    pending->timings = vkb_alloc(error, pass_count, sizeof *pending->timings);
    pending->layer_non_finite = vkb_alloc(error, layers, sizeof *pending->layer_non_finite);
    if (pending->requests && pending->outputs && pending->views && pending->timings
        && pending->layer_non_finite)
        return pending;
    vkb_pending_release(pending);
    return NULL;
}

static struct vkb_page_run *find_pages(const struct vkb_renderer *renderer, const void *memory)
{
    VKB_LOCK(vkb_memory);
    struct vkb_page_run *run = renderer->pages ? vkb_pages_find(renderer->pages, memory) : NULL;
    VKB_UNLOCK(vkb_memory);
    return run;
}

// Memory of the renderer's device, with room for the output.
static bool hold_exported(const struct vkb_renderer *renderer, const struct vkb_plan *plan,
                          uint32_t index, PyObject *array, struct vkb_output *output)
{
    const uint32_t layers = plan->graph.layers;
    const struct vkb_exports *exports;

    output->exported = vkb_export_of(array, &exports);
    output->layer_stride = layers ? vkb_layer_stride(plan, index) : 0;
    const uint64_t size =
        vkb_output_size(plan, index) + (layers ? (uint64_t)(layers - 1) * output->layer_stride : 0);
    if (exports != renderer->exports)
        return vkb_refuse("arrays: the memory is another renderer's");
    return output->exported->size >= size
        || vkb_refuse("arrays: memory of %llu bytes is needed, not of %llu",
                      (unsigned long long)size, (unsigned long long)output->exported->size);
}

// The type of the numbers of an output.
static char number_type(const struct vkb_plan *plan, uint32_t index)
{
    switch (vkb_formats[plan->graph.images[plan->outputs[index]].format].channel_size) {
    case 1:
        return VKB_UINT8;
    case 2:
        return VKB_FLOAT16;
    default:
        return VKB_FLOAT32;
    }
}

// An array has the output's type and size. None: the output stays in its image.
static bool hold_array(const struct vkb_renderer *renderer, struct vkb_pending *pending,
                       const struct vkb_plan *plan, uint32_t index, PyObject *array)
{
    Py_buffer *view = &pending->views[pending->view_count];
    struct vkb_output *output = &pending->outputs[pending->view_count];

    // Releasing a view that is not held is safe.
    ++pending->view_count;

    output->row_count = plan->graph.images[plan->outputs[index]].height;
    output->channels = vkb_graph_channels(&plan->graph, plan->outputs[index]);
    if (vkb_is_exported(array)) {
        view->obj = Py_NewRef(array);
        return hold_exported(renderer, plan, index, array, output);
    }
    if (array != Py_None) {
        if (!vkb_hold_bytes(array, "arrays", number_type(plan, index), PyBUF_WRITABLE,
                            vkb_output_size(plan, index), view))
            return false;
        output->memory = view->buf;
        // Only large arrays are looked up: the search takes time in proportion to the kept arrays.
        output->pages = view->len >= VKB_IMPORTED_BYTES ? find_pages(renderer, view->buf) : NULL;
    }
    return true;
}

static bool hold_arrays(const struct vkb_renderer *renderer, struct vkb_pending *pending,
                        PyObject *arrays)
{
    size_t passes = 0;

    for (Py_ssize_t i = 0, count = PyTuple_Size(arrays); i < count; ++i) {
        const struct vkb_plan *plan = &plan_at(pending->plans, i)->plan;
        PyObject *tuple = PyTuple_GetItem(arrays, i);
        pending->requests[i] = (struct vkb_request){
            .plan = plan,
            .outputs = pending->outputs + pending->view_count,
            .timings = pending->timings + passes,
            .layer_non_finite = pending->layer_non_finite,
        };
        passes += plan->graph.pass_count;
        for (uint32_t output = 0; output < plan->output_count; ++output)
            if (!hold_array(renderer, pending, plan, output, PyTuple_GetItem(tuple, output)))
                return false;
        ++pending->count;
    }
    return true;
}

static bool check_plan(const struct vkb_renderer *renderer, const struct vkb_source_object *source,
                       const struct vkb_plan_object *first, const struct vkb_plan_object *one)
{
    if (one->renderer != renderer->number)
        return vkb_refuse("plan: it is not of this renderer");
    if (!vkb_source_matches(&one->source, &source->source))
        return vkb_refuse("plan: it is of another source");
    return vkb_graph_same_images(&first->plan.graph, &one->plan.graph)
        || vkb_refuse("plans: they have other images, so that they cannot be run together");
}

// Whether the plans are of this renderer and source, and have an array for each output.
static bool check_run(const struct vkb_renderer *renderer, const struct vkb_source_object *source,
                      PyObject *plans, PyObject *arrays, bool shows)
{
    const Py_ssize_t count = PyTuple_Size(plans);

    if (count == 0 || PyTuple_Size(arrays) != count || (shows && count > 1))
        return vkb_refuse("plans: %zd with the arrays of %zd are out of range", count,
                          PyTuple_Size(arrays));
    for (Py_ssize_t i = 0; i < count; ++i)
        if (!vkb_require_type(PyTuple_GetItem(plans, i), state_of((PyObject *)renderer)->plan_type,
                              "plans")
            || !vkb_require_tuple(PyTuple_GetItem(arrays, i), "arrays"))
            return false;
    for (Py_ssize_t i = 0; i < count; ++i) {
        const struct vkb_plan_object *one = plan_at(plans, i);
        const Py_ssize_t given = PyTuple_Size(PyTuple_GetItem(arrays, i));
        if (!check_plan(renderer, source, plan_at(plans, 0), one))
            return false;
        if (given != one->plan.output_count || (shows && given != 1))
            return vkb_refuse("arrays: %zd are given for %u framebuffers", given,
                              one->plan.output_count);
    }
    return true;
}

// Whether the device has the memory for each plan: before it is taken for a part of the images.
static bool check_memory(const struct vkb_renderer *renderer, PyObject *plans,
                         struct vkb_error *error)
{
    for (Py_ssize_t i = 0; renderer->open && i < PyTuple_Size(plans); ++i) {
        const struct vkb_plan *plan = &plan_at(plans, i)->plan;
        uint64_t size = plan->size;
        if (vkb_shares_memory(&renderer->device, plan, (uint32_t)PyTuple_Size(plans))
            && !vkb_plan_shared_size(plan, &size, error))
            return false;
        if (!vkb_limits_check_memory(&renderer->device, &plan->graph, size, error))
            return false;
    }
    return true;
}

static struct submission *new_submission(struct vkb_renderer *renderer, PyObject *source,
                                         PyObject *plans, PyObject *arrays)
{
    struct vkb_module_state *state = state_of((PyObject *)renderer);
    struct submission *self = vkb_new_object(state->submission_type);
    struct vkb_error error = {0};

    if (!self)
        return NULL;
    self->renderer = (struct vkb_renderer *)Py_NewRef((PyObject *)renderer);
    self->pending = new_pending(source, plans, &error);
    if (!self->pending)
        vkb_raise(state, &error);
    else if (hold_arrays(renderer, self->pending, arrays))
        return self;
    Py_DECREF(self);
    return NULL;
}

static void describe_source(const struct vkb_source_object *source, bool in_place,
                            struct vkb_frame_source *data)
{
    *data = (struct vkb_frame_source){
        .scene = source->source.kind == VKB_SOURCE_SCENE ? &source->contents->data : NULL,
        .resident = source->resident,
        .in_place = in_place,
    };
    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind)
        if (source->images[kind].view.obj)
            data->inputs[kind] = &source->images[kind].input;
}

// `show` may be NULL.
static bool submit(struct vkb_renderer *renderer, const struct vkb_frame_source *data,
                   struct vkb_pending *pending, struct vkb_show *show, struct vkb_error *error)
{
    if (!vkb_renderer_enter(renderer, error))
        return false;
    bool done = vkb_require_open(renderer, error)
             && (!show || vkb_require_screen(renderer, show->screen, error))
             && vkb_frame_submit(&renderer->device, &renderer->frame, data, pending->requests,
                                 pending->count, show, &pending->submission, error);
    done = vkb_renderer_check_messages(renderer, done, error);
    vkb_renderer_leave(renderer);
    return done;
}

// (screen, width, height, linear)
static bool read_show(PyObject *tuple, struct vkb_show *show)
{
    unsigned long long screen = 0;
    int linear = false;

    if (!vkb_require_tuple(tuple, "show")
        || !PyArg_ParseTuple(tuple, "KIIp:show", &screen, &show->extent.width, &show->extent.height,
                             &linear))
        return false;
    show->screen = (struct vkb_screen *)(uintptr_t)screen;
    show->linear = linear;
    return true;
}

PyObject *vkb_renderer_run(PyObject *object, PyObject *arguments)
{
    struct vkb_renderer *renderer = (struct vkb_renderer *)object;
    struct vkb_module_state *state = state_of(object);
    PyObject *source, *plans, *arrays, *shown = Py_None, *histories = Py_None;
    int in_place = false;
    struct vkb_show show = {0};
    struct vkb_frame_source data;
    struct vkb_error error = {0};

    if (!PyArg_ParseTuple(arguments, "O!O!O!|pOO:run", state->source_type, &source, &PyTuple_Type,
                          &plans, &PyTuple_Type, &arrays, &in_place, &shown, &histories)
        || (shown != Py_None && !read_show(shown, &show)))
        return NULL;
    const bool shows = shown != Py_None;
    struct vkb_source_object *given = (struct vkb_source_object *)source;
    if (!vkb_check_source(renderer, given) || !check_run(renderer, given, plans, arrays, shows)
        || !vkb_check_histories(renderer, histories, plans))
        return NULL;
    if (!check_memory(renderer, plans, &error))
        return vkb_raise(state, &error);
    struct submission *self = new_submission(renderer, source, plans, arrays);
    if (!self)
        return NULL;
    describe_source(given, in_place, &data);
    data.fill = vkb_fill_exported;
    data.context = renderer;
    if (histories != Py_None
        && !(self->histories = vkb_hold_histories(renderer, self->pending, histories, &data))) {
        Py_DECREF(self);
        return NULL;
    }
    const bool done = submit(renderer, &data, self->pending, shows ? &show : NULL, &error);
    if (done && (!shows || show.acquired))
        return (PyObject *)self;
    Py_DECREF(self);
    return done ? Py_NewRef(Py_None) : vkb_raise(state, &error);
}

// Timings with the same name are steps of one pass.
static PyObject *timing_dict(const struct vkb_request *request)
{
    PyObject *dict = PyDict_New();

    for (uint32_t i = 0; dict && i < request->timing_count; ++i) {
        const struct vkb_timing *timing = &request->timings[i];
        PyObject *before = PyDict_GetItemString(dict, timing->name);
        if (!vkb_set_entry(
                dict, timing->name,
                PyFloat_FromDouble(timing->seconds + (before ? PyFloat_AsDouble(before) : 0.0))))
            Py_CLEAR(dict);
    }
    return dict;
}

// The numbers of NaN and infinity in the input, of a batch image by image.
static PyObject *describe_non_finite(const struct vkb_request *request)
{
    const uint32_t layers = request->plan->graph.layers, count = layers ? layers : 1;
    PyObject *tuple = PyTuple_New(2 * (Py_ssize_t)count);

    for (uint32_t i = 0; tuple && i < count; ++i) {
        const struct vkb_non_finite *input =
            layers ? &request->layer_non_finite[i] : &request->non_finite;
        if (!vkb_set_item(tuple, 2 * (Py_ssize_t)i, PyLong_FromUnsignedLongLong(input->nan))
            || !vkb_set_item(tuple, 2 * (Py_ssize_t)i + 1, PyLong_FromUnsignedLongLong(input->inf)))
            Py_CLEAR(tuple);
    }
    return tuple;
}

// ([timings, ...], (NaNs, infinities of the input, ...))
static PyObject *results(const struct vkb_pending *pending)
{
    PyObject *list = PyList_New((Py_ssize_t)pending->count);

    for (uint32_t i = 0; list && i < pending->count; ++i) {
        PyObject *timings = timing_dict(&pending->requests[i]);
        if (!timings || PyList_SetItem(list, (Py_ssize_t)i, timings) < 0)
            Py_CLEAR(list);
    }
    return list ? Py_BuildValue("(NN)", list, describe_non_finite(&pending->requests[0])) : NULL;
}

// CUDA need not wait any more for what the host has waited for.
static void complete_exported(const struct vkb_pending *pending)
{
    VKB_LOCK(vkb_memory);
    for (size_t i = 0; i < pending->view_count; ++i)
        if (pending->outputs[i].exported)
            pending->outputs[i].exported->drawn = 0;
    VKB_UNLOCK(vkb_memory);
}

static PyObject *refuse_to_wait(void)
{
    PyErr_SetString(PyExc_RuntimeError, "wait: the submission was already waited for");
    return NULL;
}

static PyObject *wait_for(PyObject *object, PyObject *unused)
{
    struct submission *self = (struct submission *)object;
    struct vkb_renderer *renderer = self->renderer;
    struct vkb_error error = {0};
    bool over = true;

    (void)unused;
    if (!self->pending)
        return refuse_to_wait();
    if (!vkb_renderer_enter(renderer, &error))
        return vkb_raise(state_of(object), &error);
    // Another thread may have taken it before this one got the lock.
    if (self->taken) {
        vkb_renderer_leave(renderer);
        return refuse_to_wait();
    }
    self->taken = true;
    struct vkb_pending *pending = self->pending;
    // A closed renderer has no submissions.
    bool done = renderer->open ? vkb_frame_collect(&renderer->device, &renderer->frame,
                                                   pending->submission, &over, &error)
                               : vkb_require_open(renderer, &error);
    done = vkb_renderer_check_messages(renderer, done, &error);
    vkb_renderer_leave(renderer);
    // Not before: a collection of garbage may visit it meanwhile, from another thread. get_ordered
    // reads it with vkb_memory.
    VKB_LOCK(vkb_memory);
    self->pending = NULL;
    VKB_UNLOCK(vkb_memory);
    if (!over) {
        vkb_renderer_abandon(renderer, pending);
        return vkb_raise(state_of(object), &error);
    }
    if (done)
        complete_exported(pending);
    PyObject *result = done ? results(pending) : vkb_raise(state_of(object), &error);
    vkb_pending_release(pending);
    return result;
}

// The outputs that CUDA shares, and those of them for which its streams wait.
struct shared_outputs {
    size_t exported, ordered, all;
};

static struct shared_outputs count_shared(PyObject *object)
{
    const struct submission *self = (struct submission *)object;
    struct shared_outputs counts = {0};

    VKB_LOCK(vkb_memory);
    const struct vkb_pending *pending = self->pending;
    counts.all = pending ? pending->view_count : 0;
    for (size_t i = 0; i < counts.all; ++i) {
        const struct vkb_export *exported = pending->outputs[i].exported;
        counts.exported += exported != NULL;
        counts.ordered += exported && exported->drawn;
    }
    VKB_UNLOCK(vkb_memory);
    return counts;
}

// Without outputs, or with one that the host has to wait for, it is not ordered.
static PyObject *get_ordered(PyObject *object, void *unused)
{
    const struct shared_outputs counts = count_shared(object);

    (void)unused;
    return PyBool_FromLong(counts.all > 0 && counts.ordered == counts.all);
}

static PyObject *get_exports_ordered(PyObject *object, void *unused)
{
    const struct shared_outputs counts = count_shared(object);

    (void)unused;
    return PyBool_FromLong(counts.exported > 0 && counts.ordered == counts.exported);
}

static PyObject *get_histories(PyObject *object, void *unused)
{
    PyObject *histories = ((struct submission *)object)->histories;

    (void)unused;
    return Py_NewRef(histories ? histories : Py_None);
}

static int traverse(PyObject *object, visitproc visit, void *arg)
{
    const struct submission *self = (struct submission *)object;
    const struct vkb_pending *pending = self->pending;

    Py_VISIT(Py_TYPE(object));
    Py_VISIT((PyObject *)self->renderer);
    Py_VISIT(self->histories);
    return pending ? vkb_pending_traverse(pending, visit, arg) : 0;
}

// While the device may still write to the arrays, the renderer keeps them.
static int clear(PyObject *object)
{
    struct submission *self = (struct submission *)object;
    struct vkb_pending *pending = self->pending;

    self->pending = NULL;
    // In a forked process no device can write to them.
    if (pending && pending->submission && vkb_renderer_is_ours(self->renderer))
        vkb_renderer_abandon(self->renderer, pending);
    else if (pending)
        vkb_pending_release(pending);
    Py_CLEAR(self->histories);
    Py_CLEAR(self->renderer);
    return 0;
}

static PyMethodDef methods[] = {
    {"wait", wait_for, METH_NOARGS,
     "wait() -> ([timings, ...], (NaNs, infinities of the input, ...)). Waits until the device has "
     "finished; then the arrays are filled."},
    {0},
};

static PyGetSetDef attributes[] = {
    {"ordered", get_ordered, NULL,
     "Whether streams of CUDA wait for all its arrays, so that the host need not.", NULL},
    {"exports_ordered", get_exports_ordered, NULL,
     "The same of those that CUDA shares; others are on the host.", NULL},
    {"histories", get_histories, NULL,
     "A Source for each history of the plan: what the next call continues from. None: none is "
     "kept.",
     NULL},
    {0},
};

static PyType_Slot slots[] = {
    {Py_tp_dealloc, vkb_dealloc},
    {Py_tp_traverse, traverse},
    {Py_tp_clear, clear},
    {Py_tp_methods, methods},
    {Py_tp_getset, attributes},
    {Py_tp_doc, "Plans that the device runs as one submission."},
    {0},
};

PyType_Spec vkb_submission_spec = {
    .name = "vkbloom._core.Submission",
    .basicsize = sizeof(struct submission),
    .flags = VKB_TYPE_FLAGS | Py_TPFLAGS_HAVE_GC,
    .slots = slots,
};
