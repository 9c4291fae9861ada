// The Plan type: the graph of a source with some settings, made without a call to Vulkan.
#include "python/plan.h"
#include "python/module.h"

#include "execute/limits.h"
#include "graph/dry_run.h"
#include "methods/adjoint.h"
#include "methods/unreal.h"

#include <stdio.h>
#include <string.h>

// The derivatives that a plan is of.
struct portion {
    struct vkb_renderer *renderer;  // keeps transposes for the next plan
    const struct vkb_cotangents *cotangents;
    uint32_t first;    // of the images of derivatives
    bool is_possible;  // whether all passes have adjoints
};

// What plans without a renderer are checked against: all that some device can do.
#define ALL_FEATURES (~(VkFormatFeatureFlags)0)
static const struct vkb_device any_device = {
    .adapter = {.name = "any"},
    .limits =
        {
            .maxComputeSharedMemorySize = UINT32_MAX,
            .maxComputeWorkGroupInvocations = UINT32_MAX,
            .maxComputeWorkGroupSize = {UINT32_MAX, UINT32_MAX, UINT32_MAX},
            .maxTexelBufferElements = UINT32_MAX,
            .maxStorageBufferRange = UINT32_MAX,
        },
    .max_side = VKB_MAX_SIDE,
    .features =
        {
            [VKB_FORMAT_RGBA8_UNORM] = ALL_FEATURES,
            [VKB_FORMAT_RGBA16_FLOAT] = ALL_FEATURES,
            [VKB_FORMAT_RGBA32_FLOAT] = ALL_FEATURES,
            [VKB_FORMAT_R32_FLOAT] = ALL_FEATURES,
            [VKB_FORMAT_RG32_FLOAT] = ALL_FEATURES,
            [VKB_FORMAT_DEPTH32_FLOAT] = ALL_FEATURES,
        },
    .dispatch = true,
    .extended_formats = true,
    .linear_texels = true,
};

static PyObject *image_names(const struct vkb_graph *graph, const uint32_t *images, uint32_t count)
{
    PyObject *tuple = PyTuple_New(count);

    for (uint32_t i = 0; tuple && i < count; ++i)
        if (!vkb_set_item(
                tuple, i,
                PyUnicode_FromString(vkb_graph_label(graph, graph->images[images[i]].name))))
            Py_CLEAR(tuple);
    return tuple;
}

// Whether all names are among those of the framebuffers; else an exception is set that says which
// one may be meant.
static bool check_names(const struct vkb_module_state *state, PyObject *names, PyObject *known)
{
    int found = vkb_require_tuple(names, "framebuffers");

    for (Py_ssize_t i = 0; found > 0 && i < PyTuple_Size(names); ++i) {
        PyObject *name = PyTuple_GetItem(names, i);
        found = PySequence_Contains(known, name);
        if (found)
            continue;
        PyObject *text = PyObject_CallFunction(state->describe_unknown, "sOO",
                                               "framebuffers: unknown framebuffer", name, known);
        if (text)
            PyErr_SetObject(PyExc_ValueError, text);
        Py_XDECREF(text);
    }
    return found > 0;
}

// The names as `outputs` has them: those of derivatives begin with VKB_INTERNAL_NAME.
static PyObject *output_names(const struct vkb_plan *plan, uint32_t count)
{
    PyObject *tuple = PyTuple_New(count);

    for (uint32_t i = 0; tuple && i < count; ++i)
        if (!vkb_set_item(tuple, i,
                          PyUnicode_FromString(plan->graph.images[plan->outputs[i]].name)))
            Py_CLEAR(tuple);
    return tuple;
}

// Keeps of the outputs those whose names are wanted.
static bool keep_outputs(const struct vkb_module_state *state, struct vkb_plan *plan,
                         uint32_t count, PyObject *names)
{
    PyObject *known = output_names(plan, count);
    bool done = known && check_names(state, names, known);

    for (uint32_t i = 0; done && i < count; ++i) {
        const int wanted = PySequence_Contains(names, PyTuple_GetItem(known, i));
        done = wanted >= 0;
        if (wanted > 0)
            plan->outputs[plan->output_count++] = plan->outputs[i];
    }
    Py_XDECREF(known);
    return done;
}

// The framebuffers from the image `first` on; those with a name among the names, unless that is
// None.
static bool choose_outputs(const struct vkb_module_state *state, struct vkb_plan *plan,
                           uint32_t first, PyObject *names)
{
    const struct vkb_graph *graph = &plan->graph;
    struct vkb_error error;
    uint32_t count = 0;

    plan->outputs = vkb_alloc(&error, graph->image_count, sizeof *plan->outputs);
    if (!plan->outputs) {
        PyErr_NoMemory();
        return false;
    }
    for (uint32_t i = first; i < graph->image_count; ++i)
        if (graph->images[i].framebuffer)
            plan->outputs[count++] = i;
    if (names != Py_None)
        return keep_outputs(state, plan, count, names);
    plan->output_count = count;
    return true;
}

static PyObject *describe_output(const struct vkb_graph *graph, uint32_t image)
{
    const struct vkb_image_row *row = &graph->images[image];
    const uint32_t channels = vkb_graph_channels(graph, image);
    const char *dtype = vkb_formats[row->format].dtype;

    return channels == 1
             ? Py_BuildValue("s(II)s", row->name, row->height, row->width, dtype)
             : Py_BuildValue("s(III)s", row->name, row->height, row->width, channels, dtype);
}

size_t vkb_output_size(const struct vkb_plan *plan, uint32_t output)
{
    const uint32_t image = plan->outputs[output];
    const struct vkb_image_row *row = &plan->graph.images[image];

    return (size_t)row->width * row->height * vkb_graph_channels(&plan->graph, image)
         * vkb_formats[row->format].channel_size;
}

size_t vkb_layer_stride(const struct vkb_plan *plan, uint32_t output)
{
    // Consumers want aligned arrays.
    enum { ALIGNMENT = 256 };

    return (vkb_output_size(plan, output) + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
}

static PyObject *describe_outputs(const struct vkb_plan *plan)
{
    PyObject *tuple = PyTuple_New(plan->output_count);

    for (uint32_t i = 0; tuple && i < plan->output_count; ++i)
        if (!vkb_set_item(tuple, i, describe_output(&plan->graph, plan->outputs[i])))
            Py_CLEAR(tuple);
    return tuple;
}

static bool layer_graph(const struct vkb_device *device, struct vkb_graph *graph,
                        struct vkb_error *error)
{
    if (graph->layers > device->limits.maxImageArrayLayers || device->linear_texels)
        return vkb_fail(error, VKB_ERROR_VALUE, "batch: the device has no images of %u layers",
                        graph->layers);
    return vkb_graph_layer(graph, error);
}

static bool build_adjoint(const struct vkb_source *source, const struct vkb_settings *settings,
                          uint32_t max_side, struct portion *portion, struct vkb_graph *graph,
                          struct vkb_error *error)
{
    struct vkb_renderer *renderer = portion->renderer;

    VKB_LOCK(renderer->guard);
    const bool built =
        vkb_build_adjoint(source, settings, portion->cotangents, max_side, &renderer->transposes,
                          graph, &portion->first, &portion->is_possible, error);
    VKB_UNLOCK(renderer->guard);
    return built;
}

// `portion` may be NULL.
static bool build_graph(const struct vkb_device *device, struct vkb_variants variants,
                        const struct vkb_source *source, const struct vkb_settings *settings,
                        struct portion *portion, struct vkb_graph *graph, struct vkb_error *error)
{
    graph->max_width = device->max_side;
    const bool built =
        (portion ? build_adjoint(source, settings, device->max_side, portion, graph, error)
                 : vkb_source_build(source, settings, device->max_side, graph, error))
        // Variants divide by the sizes of images, and add images of their own.
        && vkb_graph_check_sizes(graph, device->max_side, error)
        && vkb_variants_choose(variants, device, graph, error)
        && vkb_graph_check_sizes(graph, device->max_side, error);
    if (!built)
        return false;
    vkb_graph_set_usages(graph);
    return vkb_limits_check_graph(device, graph, error)
        && (!graph->layers || layer_graph(device, graph, error));
}

// The kernel of a convolution for the source's sizes. Unless it is kept, the graph is built once
// before it is computed, so that images which do not fit the device are refused at once: a large
// kernel takes long. (Other plans need no memory, and are checked when they are run.)
static bool hold_kernel(const struct vkb_module_state *state, const struct vkb_device *device,
                        PyObject *settings_object, struct vkb_settings *settings,
                        struct vkb_plan_object *self)
{
    struct vkb_size frame, buffers;
    struct vkb_graph graph = {0};
    struct vkb_error error = {0};
    bool is_kept;

    if (!vkb_needs_kernel(settings))
        return true;
    if (!vkb_source_sizes(&self->source, settings, device->max_side, &frame, &buffers, &error)) {
        vkb_raise(state, &error);
        return false;
    }
    if (vkb_has_gaussian_levels(settings, frame, buffers))
        return true;
    if (!vkb_find_kernel(settings_object, frame, buffers, &self->kernel, &settings->kernel,
                         &is_kept)
        || (!is_kept && !vkb_read_kernel_size(settings_object, frame, buffers, &settings->kernel)))
        return false;
    const bool fits = is_kept
                   || (build_graph(device, (struct vkb_variants){0}, &self->source, settings, NULL,
                                   &graph, &error)
                       && vkb_limits_check_memory(device, &graph, vkb_graph_size(&graph), &error));
    vkb_graph_destroy(&graph);
    if (!fits) {
        if (error.kind == VKB_ERROR_VALUE)
            vkb_add_words(&error, ". A smaller bloom_scale or kernel_size makes it so");
        vkb_raise(state, &error);
        return false;
    }
    return (is_kept
            || vkb_read_kernel(settings_object, frame, buffers, &self->kernel, &settings->kernel))
        && vkb_read_field(settings_object, frame, buffers, &self->field_weights,
                          &self->field_places, settings);
}

// `portion` may be NULL.
static PyObject *new_plan(const struct vkb_module_state *state, const struct vkb_device *device,
                          struct vkb_variants variants, PyObject *source, PyObject *settings_object,
                          struct vkb_settings *settings, struct portion *portion, PyObject *names)
{
    struct vkb_plan_object *self = vkb_new_object(state->plan_type);
    struct vkb_error error = {0};

    if (!self)
        return NULL;
    self->source = ((struct vkb_source_object *)source)->source;
    if ((settings->values.bloom && !vkb_read_dirt(settings_object, &self->dirt, settings))
        || !vkb_read_exposure_mask(settings_object, &self->meter_mask, settings)
        || !hold_kernel(state, device, settings_object, settings, self)
        || !vkb_hold_passes(state, settings_object, device->max_side, &self->source, &self->passes,
                            settings)) {
        Py_DECREF(self);
        return NULL;
    }
    if (!build_graph(device, variants, &self->source, settings, portion, &self->plan.graph,
                     &error)) {
        Py_DECREF(self);
        return vkb_raise(state, &error);
    }
    // A plan without a renderer cannot be run: it needs only the serials.
    if (device->adapter.physical == VK_NULL_HANDLE) {
        PyBuffer_Release(&self->kernel);
        PyBuffer_Release(&self->field_weights);
        PyBuffer_Release(&self->field_places);
        PyBuffer_Release(&self->dirt);
        PyBuffer_Release(&self->meter_mask);
    }
    if (!choose_outputs(state, &self->plan, portion ? portion->first : 0, names)
        || !(self->outputs = describe_outputs(&self->plan))) {
        Py_DECREF(self);
        return NULL;
    }
    if (!vkb_plan_measure(&self->plan, &error)) {
        Py_DECREF(self);
        return vkb_raise(state, &error);
    }
    return (PyObject *)self;
}

static bool read_cotangents(PyObject *tuple, struct vkb_cotangents *cotangents)
{
    const Py_ssize_t count = PyTuple_Size(tuple);

    if (count > GATHERED_LEVELS)
        return vkb_refuse("cotangents: %zd framebuffers are out of range, 0 to %d", count,
                          GATHERED_LEVELS);
    cotangents->count = (uint32_t)count;
    for (uint32_t i = 0; i < cotangents->count; ++i) {
        const char *name = PyUnicode_AsUTF8AndSize(PyTuple_GetItem(tuple, i), NULL);
        if (!name)
            return false;
        vkb_set_name(cotangents->names[i], VKB_NAME_SIZE, name);
    }
    return true;
}

static bool read_results(const char *name, struct vkb_cotangents *cotangents)
{
    const bool all = strcmp(name, "all") == 0;

    cotangents->images = all || strcmp(name, "images") == 0;
    cotangents->weights = strcmp(name, "weights") == 0;
    return cotangents->images || cotangents->weights || strcmp(name, "sums") == 0
        || vkb_refuse("results: '%s' is not 'images', 'sums', 'all' or 'weights'", name);
}

static bool read_sums(PyObject *tuple, struct vkb_wanted_sums *sums)
{
    const struct {
        const char *name;
        bool *is_wanted;
    } rows[] = {
#define VKB_SUM_ROW(name) {#name, &sums->name},
        VKB_SUMS(VKB_SUM_ROW)
#undef VKB_SUM_ROW
    };
    const size_t count = sizeof rows / sizeof *rows;

    for (Py_ssize_t i = 0; i < PyTuple_Size(tuple); ++i) {
        const char *name = PyUnicode_AsUTF8AndSize(PyTuple_GetItem(tuple, i), NULL);
        size_t row = 0;
        while (name && row < count && strcmp(name, rows[row].name) != 0)
            ++row;
        if (!name || row == count)
            return name && vkb_refuse("sums: there is none named '%s'", name);
        *rows[row].is_wanted = true;
    }
    return true;
}

PyObject *vkb_renderer_plan(PyObject *object, PyObject *arguments)
{
    struct vkb_renderer *renderer = (struct vkb_renderer *)object;
    const struct vkb_module_state *state = PyType_GetModuleState(Py_TYPE(object));
    PyObject *source, *settings_object, *names, *cotangents = NULL, *sums = NULL;
    struct vkb_cotangents given = {0};
    struct portion portion = {.renderer = renderer, .cotangents = &given, .is_possible = true};
    struct vkb_settings settings;
    struct vkb_error error = {0};
    const char *results = "images";

    if (!PyArg_ParseTuple(arguments, "O!OO|O!sO!:plan", state->source_type, &source,
                          &settings_object, &names, &PyTuple_Type, &cotangents, &results,
                          &PyTuple_Type, &sums)
        || !vkb_read_settings(settings_object, &settings)
        || (cotangents && !read_cotangents(cotangents, &given)) || !read_results(results, &given)
        || (sums && !read_sums(sums, &given.sums)))
        return NULL;
    if (cotangents && ((struct vkb_source_object *)source)->source.kind != VKB_SOURCE_IMAGE) {
        vkb_refuse("cotangents: the source is not an image");
        return NULL;
    }
    if (!vkb_require_open(renderer, &error))
        return vkb_raise(state, &error);
    if (!vkb_check_source(renderer, (struct vkb_source_object *)source))
        return NULL;
    PyObject *plan = new_plan(state, &renderer->device, renderer->variants, source, settings_object,
                              &settings, cotangents ? &portion : NULL, names);
    if (plan)
        ((struct vkb_plan_object *)plan)->renderer = renderer->number;
    if (!plan || portion.is_possible)
        return plan;
    Py_DECREF(plan);
    Py_RETURN_NONE;
}

PyObject *vkb_any_plan(PyObject *module, PyObject *arguments)
{
    const struct vkb_module_state *state = vkb_module_state(module);
    PyObject *source, *settings_object, *names;
    struct vkb_settings settings;
    struct vkb_device device = any_device;
    struct vkb_error error = {0};
    struct vkb_variants variants;
    const char *name = "fragment";

    if (!PyArg_ParseTuple(arguments, "O!OO|s:plan", state->source_type, &source, &settings_object,
                          &names, &name)
        || !vkb_read_settings(settings_object, &settings))
        return NULL;
    if (!vkb_variants_by_name(name, &device, &variants, &error))
        return vkb_raise(state, &error);
    // What the variant is for.
    device.adapter.device_type = variants.column == VKB_VARIANTS_CPU
                                   ? VK_PHYSICAL_DEVICE_TYPE_CPU
                                   : VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU;
    return new_plan(state, &device, variants, source, settings_object, &settings, NULL, names);
}

static PyObject *describe_pass(const struct vkb_graph *graph, const char *name, uint32_t index,
                               uint32_t group)
{
    const struct vkb_pass_row *pass = &graph->passes[index];
    uint32_t targets[VKB_MAX_TARGETS + 1], reads[VKB_MAX_READS], read_count = 0;
    const uint32_t target_count = vkb_pass_targets(pass, targets);

    for (uint32_t slot = 0; slot < pass->read_count; ++slot)
        if (pass->reads[slot] != VKB_NO_IMAGE)
            reads[read_count++] = pass->reads[slot];
    return Py_BuildValue("(ssNNsI)", name, pass->shader->name,
                         image_names(graph, reads, read_count),
                         image_names(graph, targets, target_count),
                         pass->variant ? pass->variant : "fragment", group);
}

static bool add_group(PyObject *list, const struct vkb_graph *graph, uint32_t first, uint32_t end,
                      uint32_t group)
{
    const char *name = vkb_graph_timed_as(graph, first);
    bool done = true;

    for (uint32_t i = first; done && i < end; ++i)
        done = vkb_append_item(list, describe_pass(graph, name, i, group));
    return done;
}

PyObject *vkb_passes_that_run(const struct vkb_module_state *state, struct vkb_dry_run *dry_run,
                              const struct vkb_plan *plan, uint64_t source)
{
    const struct vkb_graph *graph = &plan->graph;
    struct vkb_error error = {0};
    bool *ran = vkb_alloc(&error, graph->pass_count, sizeof *ran);
    const bool done = ran && vkb_dry_run_step(dry_run, plan, source, ran, &error);
    PyObject *list = done ? PyList_New(0) : vkb_raise(state, &error);
    uint32_t group = 0;

    for (uint32_t first = 0, end; list && first < graph->pass_count; first = end) {
        end = vkb_graph_group_end(graph, first);
        if (!ran[first])
            continue;
        if (!add_group(list, graph, first, end, group))
            Py_CLEAR(list);
        ++group;
    }
    vkb_free(ran);
    return list;
}

static PyObject *get_passes(PyObject *object, void *unused)
{
    struct vkb_dry_run dry_run = {0};

    (void)unused;
    PyObject *list = vkb_passes_that_run(PyType_GetModuleState(Py_TYPE(object)), &dry_run,
                                         &((struct vkb_plan_object *)object)->plan, 0);
    vkb_dry_run_destroy(&dry_run);
    return list;
}

static PyObject *get_outputs(PyObject *object, void *unused)
{
    (void)unused;
    return Py_NewRef(((struct vkb_plan_object *)object)->outputs);
}

static PyObject *get_histories(PyObject *object, void *unused)
{
    const struct vkb_graph *graph = &((struct vkb_plan_object *)object)->plan.graph;
    PyObject *list = PyList_New(0);

    (void)unused;
    for (uint32_t i = 0; list && i < graph->image_count; ++i)
        if (vkb_is_history(&graph->images[i])
            && !vkb_append_item(list, describe_output(graph, graph->images[i].history_of)))
            Py_CLEAR(list);
    PyObject *tuple = list ? PyList_AsTuple(list) : NULL;
    Py_XDECREF(list);
    return tuple;
}

static PyObject *get_image_size(PyObject *object, void *unused)
{
    (void)unused;
    return PyLong_FromUnsignedLongLong(
        vkb_graph_size(&((struct vkb_plan_object *)object)->plan.graph));
}

static PyObject *shares_images(PyObject *object, PyObject *other)
{
    const struct vkb_module_state *state = PyType_GetModuleState(Py_TYPE(object));

    if (!vkb_require_type(other, state->plan_type, "plan"))
        return NULL;
    return PyBool_FromLong(vkb_graph_same_images(&((struct vkb_plan_object *)object)->plan.graph,
                                                 &((struct vkb_plan_object *)other)->plan.graph));
}

static PyObject *is_of(PyObject *object, PyObject *other)
{
    const struct vkb_module_state *state = PyType_GetModuleState(Py_TYPE(object));

    if (!vkb_require_type(other, state->source_type, "source"))
        return NULL;
    return PyBool_FromLong(vkb_source_fits(&((struct vkb_plan_object *)object)->source,
                                           &((struct vkb_source_object *)other)->source));
}

static int traverse(PyObject *object, visitproc visit, void *arg)
{
    const struct vkb_plan_object *self = (struct vkb_plan_object *)object;

    Py_VISIT(Py_TYPE(object));
    Py_VISIT(self->outputs);
    Py_VISIT(self->kernel.obj);
    Py_VISIT(self->field_weights.obj);
    Py_VISIT(self->field_places.obj);
    Py_VISIT(self->dirt.obj);
    Py_VISIT(self->meter_mask.obj);
    Py_VISIT(self->passes.tuple);
    return 0;
}

static void dealloc(PyObject *object)
{
    struct vkb_plan_object *self = (struct vkb_plan_object *)object;

    PyObject_GC_UnTrack(object);
    vkb_plan_destroy(&self->plan);
    PyBuffer_Release(&self->kernel);
    PyBuffer_Release(&self->field_weights);
    PyBuffer_Release(&self->field_places);
    PyBuffer_Release(&self->dirt);
    PyBuffer_Release(&self->meter_mask);
    vkb_release_passes(&self->passes);
    Py_XDECREF(self->outputs);
    vkb_free_object(object);
}

static PyMethodDef methods[] = {
    {"shares_images", shares_images, METH_O,
     "shares_images(plan) -> bool. Whether both have the same images, so that they can be run "
     "together."},
    {"is_of", is_of, METH_O,
     "is_of(source) -> bool. Whether this is the plan of the source, too, with the same settings: "
     "of such an image, or of the same frame of such a scene."},
    {0},
};

static PyGetSetDef attributes[] = {
    {"outputs", get_outputs, NULL, "((name, shape, dtype), ...) of the framebuffers wanted.", NULL},
    {"passes", get_passes, NULL,
     "[(name, shader, reads, writes, variant, number of its render pass), ...] of what runs where "
     "nothing has run before.",
     NULL},
    {"histories", get_histories, NULL,
     "((name, shape, dtype), ...) of the framebuffers whose content the next call reads.", NULL},
    {"image_size", get_image_size, NULL, "Bytes of all images on the device.", NULL},
    {0},
};

// No tp_clear: `outputs` cannot be part of a reference cycle, and a submission may need the graph.
static PyType_Slot slots[] = {
    {Py_tp_dealloc, dealloc},
    {Py_tp_traverse, traverse},
    {Py_tp_methods, methods},
    {Py_tp_getset, attributes},
    {Py_tp_doc, "The graph of a source with some settings."},
    {0},
};

PyType_Spec vkb_plan_spec = {
    .name = "vkbloom._core.Plan",
    .basicsize = sizeof(struct vkb_plan_object),
    .flags = VKB_TYPE_FLAGS | Py_TPFLAGS_HAVE_GC,
    .slots = slots,
};
