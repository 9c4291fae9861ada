// A graph as Python data, for tests and for those who want to see how a frame is made.
#include "python/module.h"

static PyObject *image_names(const struct vkb_graph *graph, const uint32_t *images, uint32_t count)
{
    PyObject *list = PyList_New(0);

    for (uint32_t i = 0; list && i < count; ++i) {
        PyObject *name = PyUnicode_FromString(graph->images[images[i]].name);
        if (!name || PyList_Append(list, name) < 0)
            Py_CLEAR(list);
        Py_XDECREF(name);
    }
    return list;
}

// One dict a pass; passes of one render pass have the same "render_pass" number.
static PyObject *describe_pass(const struct vkb_graph *graph, uint32_t index, int render_pass)
{
    const struct vkb_pass_row *pass = &graph->passes[index];
    uint32_t targets[VKB_MAX_TARGETS + 1], target_count = 0;

    for (uint32_t i = 0; i < pass->target_count; ++i)
        targets[target_count++] = pass->targets[i];
    if (pass->depth != VKB_NO_IMAGE)
        targets[target_count++] = pass->depth;
    return Py_BuildValue("{sssNsNsi}", "name", pass->name, "reads",
                         image_names(graph, pass->reads, pass->read_count), "targets",
                         image_names(graph, targets, target_count), "render_pass", render_pass);
}

// (source subpass, target subpass, source stages, target stages, source access, target access,
// flags); an external subpass is -1.
static PyObject *describe_dependency(const VkSubpassDependency *dependency)
{
    return Py_BuildValue(
        "(iikkkkk)", (int)dependency->srcSubpass, (int)dependency->dstSubpass,
        (unsigned long)dependency->srcStageMask, (unsigned long)dependency->dstStageMask,
        (unsigned long)dependency->srcAccessMask, (unsigned long)dependency->dstAccessMask,
        (unsigned long)dependency->dependencyFlags);
}

static PyObject *describe_render_pass(const struct vkb_graph *graph, uint32_t first, uint32_t end)
{
    struct vkb_target_use uses[VKB_MAX_TARGETS + 1];
    VkSubpassDependency dependencies[VKB_MAX_DEPENDENCIES];
    const uint32_t use_count = vkb_graph_target_uses(graph, first, end, uses);
    const uint32_t count = vkb_subpass_dependencies(uses, use_count, dependencies);
    PyObject *list = PyList_New(0);

    for (uint32_t i = 0; list && i < count; ++i) {
        PyObject *tuple = describe_dependency(&dependencies[i]);
        if (!tuple || PyList_Append(list, tuple) < 0)
            Py_CLEAR(list);
        Py_XDECREF(tuple);
    }
    return list;
}

static bool append_steal(PyObject *list, PyObject *item)
{
    bool done = item && PyList_Append(list, item) == 0;
    Py_XDECREF(item);
    return done;
}

static PyObject *describe_graph(const struct vkb_graph *graph)
{
    PyObject *passes = PyList_New(0), *render_passes = PyList_New(0), *result = NULL;
    bool done = passes && render_passes;
    int number = 0;

    for (uint32_t first = 0, end; done && first < graph->pass_count; first = end, ++number) {
        end = vkb_graph_group_end(graph, first);
        for (uint32_t i = first; done && i < end; ++i)
            done = append_steal(passes, describe_pass(graph, i, number));
        done = done && append_steal(render_passes, describe_render_pass(graph, first, end));
    }
    if (done)
        result = Py_BuildValue("{sOsO}", "passes", passes, "dependencies", render_passes);
    Py_XDECREF(passes);
    Py_XDECREF(render_passes);
    return result;
}

PyObject *vkb_describe(PyObject *module, PyObject *arguments)
{
    PyObject *settings_object, *result = NULL;
    struct vkb_settings settings;
    struct vkb_scene_source source = {
        .camera = {.fov = 45.0, .near = 0.1, .far = 256.0},
        .glow_intensity = 1.0,
        .has_glow = true,
    };
    const char *shading;
    struct vkb_graph graph = {0};
    struct vkb_error error = {0};
    int has_sky;

    if (!PyArg_ParseTuple(arguments, "O(O&O&)ps:describe", &settings_object, vkb_read_uint32,
                          &source.size.width, vkb_read_uint32, &source.size.height, &has_sky,
                          &shading)
        || !vkb_read_settings(vkb_module_state(module), settings_object, &settings))
        return NULL;
    source.has_sky = has_sky;
    if (vkb_check_sizes(&settings, "size", source.size, VKB_MAX_SIDE, &error)
        && vkb_build_scene(shading, &settings, &source, &graph, &error)
        && vkb_graph_check(&graph, VKB_MAX_SIDE, &error))
        result = describe_graph(&graph);
    else
        vkb_raise(vkb_module_state(module), &error);
    vkb_graph_destroy(&graph);
    return result;
}
