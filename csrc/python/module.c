// The extension module: its state, its exceptions, the tables of the settings.
#include "python/module.h"
#include "python/arguments.h"
#include "python/guard.h"

#include "graph/params.h"

#include <string.h>

static PyObject *adapters(PyObject *module, PyObject *arguments)
{
    const char *driver;
    struct vkb_adapter_info found[VKB_MAX_ADAPTERS];
    struct vkb_error error = {0};
    uint32_t count = 0;
    bool done;

    if (!PyArg_ParseTuple(arguments, "s:adapters", &driver))
        return NULL;
    Py_BEGIN_ALLOW_THREADS
    struct vkb_instance *instance = vkb_instance_open(driver, false, &error);
    done = instance && vkb_adapters_list(instance, found, &count, &error);
    if (instance)
        vkb_instance_close(instance);
    if (!done)
        vkb_instance_explain(&error);
    Py_END_ALLOW_THREADS
    if (!done)
        return vkb_raise(vkb_module_state(module), &error);

    PyObject *list = PyList_New(0);
    for (uint32_t i = 0; list && i < count; ++i)
        if (!vkb_append_item(list, vkb_adapter_tuple(&found[i])))
            Py_CLEAR(list);
    return list;
}

static PyObject *end_instances(PyObject *module, PyObject *unused)
{
    (void)module;
    (void)unused;
    Py_BEGIN_ALLOW_THREADS
    vkb_instances_end();
    Py_END_ALLOW_THREADS
    return Py_NewRef(Py_None);
}

static PyObject *fail_without_adapter(PyObject *module, PyObject *text)
{
    struct vkb_error error;
    const char *message = PyUnicode_AsUTF8AndSize(text, NULL);

    if (!message)
        return NULL;
    vkb_fail(&error, VKB_ERROR_ADAPTER_NOT_FOUND, "%s. %s", message, vkb_install_hint);
    vkb_instance_explain(&error);
    return vkb_raise(vkb_module_state(module), &error);
}

// The names of the exceptions, as the package has them.
static const char *const error_names[VKB_ERROR_VALUE] = {
    [VKB_ERROR_GENERAL] = "Error",
    [VKB_ERROR_ADAPTER_NOT_FOUND] = "AdapterNotFoundError",
    [VKB_ERROR_DEVICE_LOST] = "DeviceLostError",
    [VKB_ERROR_OUT_OF_MEMORY] = "OutOfMemoryError",
    [VKB_ERROR_VALIDATION] = "ValidationError",
    [VKB_ERROR_SHADER] = "ShaderError",
};

// Sets a reference, which it takes.
static void replace(PyObject **reference, PyObject *object)
{
    PyObject *old = *reference;

    *reference = object;
    Py_XDECREF(old);
}

static PyObject *connect(PyObject *module, PyObject *arguments)
{
    struct vkb_module_state *state = vkb_module_state(module);
    PyObject *errors, *describe_unknown;

    if (!PyArg_ParseTuple(arguments, "OO:connect", &errors, &describe_unknown))
        return NULL;
    for (int kind = VKB_ERROR_GENERAL; kind < VKB_ERROR_VALUE; ++kind) {
        PyObject *class = PyObject_GetAttrString(errors, error_names[kind]);
        if (!class || PyModule_AddObjectRef(module, error_names[kind], class) < 0) {
            Py_XDECREF(class);
            return NULL;
        }
        replace(&state->errors[kind], class);
    }
    replace(&state->describe_unknown, Py_NewRef(describe_unknown));
    Py_RETURN_NONE;
}

static PyMethodDef functions[] = {
    {"connect", connect, METH_VARARGS,
     "connect(errors, describe_unknown): gives the core what it needs of the package, once: a "
     "module "
     "with the exceptions; a function of what is unknown, its name and the known ones, which "
     "returns "
     "the text of the error."},
    {"fail_without_adapter", fail_without_adapter, METH_O,
     "fail_without_adapter(text): raises AdapterNotFoundError, with what to install."},
    {"adapters", adapters, METH_VARARGS,
     "adapters(driver): describes those that can run vkbloom; \"\": the loader's."},
    {"end_instances", end_instances, METH_NOARGS,
     "end_instances(): destroys the Vulkan instances without users, before the process exits."},
    {"image_source", vkb_image_source, METH_VARARGS,
     "image_source(image, emission=None, mask=None, levels=()) -> Source. The levels are images "
     "that another part of a graph has made."},
    {"scene_contents", vkb_scene_contents, METH_VARARGS,
     "scene_contents(block, pictures, arrays) -> SceneContents. As _scene/blocks.py packs it."},
    {"scene_source", vkb_scene_source, METH_VARARGS,
     "scene_source(contents, block) -> Source. A frame, as _scene/blocks.py packs it."},
    {"plan", vkb_any_plan, METH_VARARGS,
     "plan(source, settings, names, variants=\"fragment\") -> Plan. For no renderer: what one with "
     "those variants would do; by default it draws every pass as its method defines it."},
    {"read_dlpack", vkb_read_dlpack, METH_O,
     "read_dlpack(capsule) -> (address, device, dtype, shape, strides). Does not consume it."},
    {"resource_owner", vkb_resource_owner, METH_NOARGS,
     "resource_owner() -> object. Renderers keep the state of its resources until it is deleted."},
    {"dry_run", vkb_dry_run_steps, METH_O,
     "dry_run(((source, plan), ...)) -> [[pass, ...], ...]. Of each plan the passes (Plan.passes) "
     "that run after those before it, on a renderer that has run nothing."},
#ifdef VKBLOOM_FAULTS
    {"arm_fault", vkb_fault_arm, METH_VARARGS,
     "arm_fault(n, result, names): the n-th call of those names (\"\": of all) answers result."},
    {"fault_state", vkb_fault_state, METH_NOARGS,
     "(calls since then, the one that failed or \"\", blocks, validation messages)"},
    {"forget_instances", vkb_fault_forget, METH_NOARGS,
     "Destroys the Vulkan instances; all renderers must be closed."},
    {"fold_by_driver", vkb_fault_fold, METH_O,
     "fold_by_driver(bool): whether drivers fold the constants of new pipelines, not the core."},
#endif
    {0},
};

static bool add_steal(PyObject *module, const char *name, PyObject *value)
{
    int result = PyModule_AddObjectRef(module, name, value);
    Py_XDECREF(value);
    return result == 0;
}

// {name: (default, low, high)}
static PyObject *value_table(const struct vkb_value_row *rows, size_t count)
{
    PyObject *table = PyDict_New();

    for (size_t i = 0; table && i < count; ++i) {
        const struct vkb_value_row *row = &rows[i];
        if (!vkb_set_entry(
                table, row->name,
                row->type == VKB_VALUE_INT
                    ? Py_BuildValue("(iii)", (int)row->initial, (int)row->low, (int)row->high)
                    : Py_BuildValue("(ddd)", row->initial, row->low, row->high)))
            Py_CLEAR(table);
    }
    return table;
}

static PyObject *name_tuple(const char *const *names, Py_ssize_t count)
{
    PyObject *tuple = PyTuple_New(count);

    for (Py_ssize_t i = 0; tuple && i < count; ++i)
        if (!vkb_set_item(tuple, i, PyUnicode_FromString(names[i])))
            Py_CLEAR(tuple);
    return tuple;
}

static PyObject *method_tuple(void)
{
    const char *names[VKB_METHOD_COUNT];

    for (int i = 0; i < VKB_METHOD_COUNT; ++i)
        names[i] = vkb_method_rows[i].name;
    return name_tuple(names, VKB_METHOD_COUNT);
}

#define STAGE_NAME(constant, name) [VKB_STAGE_##constant] = #name,
static const char *const stages[] = {VKB_STAGES(STAGE_NAME)};

// The first one stands for none.
#define ENGINE_NAME(constant, value, name, ...) [value] = #name,
static const char *const exposures[] = {[0] = "none", EXPOSURES(ENGINE_NAME)};
#define NUMBER_NAME(B, type, name) #name,
static const char *const exposure_numbers[] = {EXPOSURE_NUMBER_ROWS(, NUMBER_NAME)};
static const char *const taas[] = {[0] = "none", TAAS(ENGINE_NAME)};
static const char *const taa_numbers[] = {TAA_NUMBER_ROWS(, NUMBER_NAME)};

static PyObject *format_tuple(void)
{
    const char *names[VKB_FORMAT_COUNT];

    for (int i = 0; i < VKB_FORMAT_COUNT; ++i)
        names[i] = vkb_formats[i].name;
    return name_tuple(names, VKB_FORMAT_COUNT);
}

// {name: (spelling, ...)}
static PyObject *choice_table(void)
{
    PyObject *table = PyDict_New();

    for (size_t i = 0; table && i < VKB_CHOICE_COUNT; ++i) {
        const struct vkb_choice_row *row = &vkb_choice_rows[i];
        if (!vkb_set_entry(table, row->name, name_tuple(row->spellings, row->count)))
            Py_CLEAR(table);
    }
    return table;
}

static bool add_type(PyObject *module, PyType_Spec *spec, const char *name, PyObject **type)
{
    *type = PyType_FromModuleAndSpec(module, spec, NULL);
    return *type && PyModule_AddObjectRef(module, name, *type) == 0;
}

static int execute(PyObject *module)
{
    struct vkb_module_state *state = vkb_module_state(module);

    if (!vkb_guards_begin()) {
        PyErr_NoMemory();
        return -1;
    }
    for (int kind = VKB_ERROR_GENERAL; kind < VKB_ERROR_VALUE; ++kind)
        state->errors[kind] = Py_NewRef(PyExc_RuntimeError);
    state->errors[VKB_ERROR_VALUE] = Py_NewRef(PyExc_ValueError);
    return add_type(module, &vkb_renderer_spec, "Renderer", &state->renderer_type)
                && add_type(module, &vkb_source_spec, "Source", &state->source_type)
                && add_type(module, &vkb_contents_spec, "SceneContents", &state->contents_type)
                && add_type(module, &vkb_plan_spec, "Plan", &state->plan_type)
                && add_type(module, &vkb_submission_spec, "Submission", &state->submission_type)
                && add_type(module, &vkb_pages_spec, "Pages", &state->pages_type)
                && add_type(module, &vkb_exported_spec, "Exported", &state->exported_type)
                && add_steal(module, "VALUES", value_table(vkb_value_rows, vkb_value_row_count))
                && add_steal(module, "GLARE_VALUES",
                             value_table(vkb_glare_rows, vkb_glare_row_count))
                && add_steal(module, "CHOICES", choice_table())
                && add_steal(module, "METHODS", method_tuple())
                && add_steal(module, "STAGES", name_tuple(stages, VKB_STAGE_COUNT))
                && add_steal(module, "EXPOSURES",
                             name_tuple(exposures, sizeof exposures / sizeof exposures[0]))
                && add_steal(module, "EXPOSURE_NUMBERS",
                             name_tuple(exposure_numbers, VKB_EXPOSURE_NUMBERS))
                && add_steal(module, "TAAS", name_tuple(taas, sizeof taas / sizeof taas[0]))
                && add_steal(module, "TAA_NUMBERS", name_tuple(taa_numbers, VKB_TAA_NUMBERS))
                && add_steal(module, "FORMATS", format_tuple())
                && add_steal(module, "SETTINGS_BLOCK", vkb_settings_block_table())
                && add_steal(module, "STAGE_BLOCK", vkb_stage_block_table())
                && PyModule_AddIntMacro(module, MAX_WEIGHTS) == 0
                && PyModule_AddIntMacro(module, MAX_LAYERS) == 0
                && PyModule_AddIntMacro(module, MAX_STAGES) == 0
                && PyModule_AddIntMacro(module, MAX_GHOSTS) == 0
                && PyModule_AddIntMacro(module, TAA_PHASES) == 0
             ? 0
             : -1;
}

// The state consists of references.
enum { REFERENCES = sizeof(struct vkb_module_state) / sizeof(PyObject *) };

static int traverse(PyObject *module, visitproc visit, void *arg)
{
    PyObject **references = (PyObject **)vkb_module_state(module);

    for (size_t i = 0; i < REFERENCES; ++i)
        Py_VISIT(references[i]);
    return 0;
}

static int clear(PyObject *module)
{
    PyObject **references = (PyObject **)vkb_module_state(module);

    for (size_t i = 0; i < REFERENCES; ++i)
        Py_CLEAR(references[i]);
    return 0;
}

static void free_module(void *module)
{
    clear(module);
}

static PyModuleDef_Slot slots[] = {
    {Py_mod_exec, execute},
#ifdef Py_GIL_DISABLED
    {Py_mod_gil, Py_MOD_GIL_NOT_USED},
#endif
    {0},
};

static PyModuleDef definition = {
    PyModuleDef_HEAD_INIT,
    .m_name = "vkbloom._core",
    .m_doc = "The C core: adapters, the Renderer type, the tables of the settings.",
    .m_size = sizeof(struct vkb_module_state),
    .m_methods = functions,
    .m_slots = slots,
    .m_traverse = traverse,
    .m_clear = clear,
    .m_free = free_module,
};

PyMODINIT_FUNC PyInit__core(void)
{
    return PyModuleDef_Init(&definition);
}
