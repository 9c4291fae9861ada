// The Exported type: memory of a renderer's device that CUDA shares, as other libraries take it.
#include "python/arguments.h"
#include "python/dlpack.h"
#include "python/module.h"
#include "python/renderer.h"

struct exported_object {
    PyObject_HEAD
    struct vkb_exports *exports;
    struct vkb_export *run;
    long process;  // the process that opened the renderer
};

static struct exported_object *exported_of(PyObject *object)
{
    return (struct exported_object *)object;
}

// Frees idle memory that is not kept, or with `all` all of it. CUDA waits for streams then, and
// these may wait for the GIL.
static void free_surplus(struct vkb_exports *exports, bool all)
{
    struct vkb_export *surplus;

    do {
        VKB_LOCK(vkb_memory);
        surplus = vkb_exports_surplus(exports, all);
        VKB_UNLOCK(vkb_memory);
        if (surplus) {
            Py_BEGIN_ALLOW_THREADS
            vkb_cuda_free(exports->cuda, &surplus->memory);
            Py_END_ALLOW_THREADS
            VKB_LOCK(vkb_memory);
            vkb_exports_remove(surplus);
            VKB_UNLOCK(vkb_memory);
        }
    } while (surplus);
}

void vkb_release_exports(struct vkb_exports *exports)
{
    free_surplus(exports, false);
    VKB_LOCK(vkb_memory);
    const bool last = --exports->users == 0;
    VKB_UNLOCK(vkb_memory);
    if (last) {
        Py_BEGIN_ALLOW_THREADS
        vkb_exports_free(exports);
        Py_END_ALLOW_THREADS
    }
}

static void dealloc(PyObject *object)
{
    struct exported_object *self = exported_of(object);

    // A forked process returns nothing: the device belongs to its parent.
    if (self->exports && self->process == vkb_current_process()) {
        VKB_LOCK(vkb_memory);
        if (self->run)
            vkb_exports_give_back(self->exports, self->run);
        VKB_UNLOCK(vkb_memory);
        vkb_release_exports(self->exports);
    }
    vkb_free_object(object);
}

static vkb_cuda_address address_of(const struct exported_object *self, Py_ssize_t offset)
{
    return self->run->memory.address + (vkb_cuda_address)offset;
}

bool vkb_is_exported(PyObject *object)
{
    return PyType_GetSlot(Py_TYPE(object), Py_tp_dealloc) == (void *)dealloc;
}

struct vkb_export *vkb_export_of(PyObject *object, const struct vkb_exports **exports)
{
    *exports = exported_of(object)->exports;
    return exported_of(object)->run;
}

// Opens CUDA at the first call, without the GIL: it takes long. The renderer's lock keeps the
// device.
static bool open_exports(struct vkb_renderer *renderer, struct vkb_error *error)
{
    struct vkb_exports *exports = NULL;

    if (renderer->exports)
        return true;
    if (!vkb_renderer_enter(renderer, error))
        return false;
    bool done = vkb_require_open(renderer, error);
    if (done && !renderer->exports) {
        exports = vkb_exports_create(&renderer->device, error);
        done = exports;
    }
    vkb_renderer_leave_with(renderer, exports);
    return done;
}

// The exports of an open renderer, with vkb_memory; else NULL.
static struct vkb_exports *find_exports(const struct vkb_renderer *renderer,
                                        struct vkb_error *error)
{
    struct vkb_exports *exports = vkb_require_open(renderer, error) ? renderer->exports : NULL;

    if (!exports && error->kind == VKB_OK)
        vkb_fail(error, VKB_ERROR_VALUE, "the renderer is closed");
    return exports;
}

// As open_exports, as a user of them.
static struct vkb_exports *use_exports(struct vkb_renderer *renderer, struct vkb_error *error)
{
    if (!open_exports(renderer, error))
        return NULL;
    VKB_LOCK(vkb_memory);
    struct vkb_exports *exports = find_exports(renderer, error);
    if (exports)
        ++exports->users;
    VKB_UNLOCK(vkb_memory);
    return exports;
}

// Takes memory for a new object, whose `exports` it uses.
static bool take_memory(struct exported_object *self, Py_ssize_t size, struct vkb_error *error)
{
    VKB_LOCK(vkb_memory);
    if (self->exports->device)
        self->run = vkb_exports_take(self->exports, (uint64_t)size, error);
    else
        vkb_fail(error, VKB_ERROR_VALUE, "the renderer is closed");
    VKB_UNLOCK(vkb_memory);
    return self->run != NULL;
}

static struct exported_object *new_exported(struct vkb_renderer *renderer, Py_ssize_t size)
{
    const struct vkb_module_state *state = PyType_GetModuleState(Py_TYPE((PyObject *)renderer));
    struct vkb_error error = {0};

    struct exported_object *self = vkb_new_object(state->exported_type);
    if (!self)
        return NULL;
    self->process = renderer->process;
    self->exports = use_exports(renderer, &error);
    bool done = self->exports && take_memory(self, size, &error);
    if (!done && self->exports && error.kind == VKB_ERROR_OUT_OF_MEMORY) {
        free_surplus(self->exports, true);
        error = (struct vkb_error){0};
        done = take_memory(self, size, &error);
    }
    if (done)
        return self;
    Py_DECREF(self);
    return (void *)vkb_raise(state, &error);
}

PyObject *vkb_renderer_export(PyObject *renderer, PyObject *argument)
{
    const Py_ssize_t size = PyLong_AsSsize_t(argument);

    return PyErr_Occurred() || !vkb_check_bytes("export", size)
             ? NULL
             : (PyObject *)new_exported((struct vkb_renderer *)renderer, size);
}

PyObject *vkb_renderer_cuda(PyObject *object, PyObject *unused)
{
    const struct vkb_module_state *state = PyType_GetModuleState(Py_TYPE(object));
    struct vkb_error error = {0};
    int ordinal = 0;
    void *stream = NULL;

    (void)unused;
    if (!open_exports((struct vkb_renderer *)object, &error))
        return vkb_raise(state, &error);
    VKB_LOCK(vkb_memory);
    const struct vkb_exports *exports = find_exports((struct vkb_renderer *)object, &error);
    if (exports) {
        ordinal = vkb_cuda_ordinal(exports->cuda);
        stream = vkb_cuda_stream(exports->cuda);
    }
    VKB_UNLOCK(vkb_memory);
    return exports ? Py_BuildValue("(iN)", ordinal, PyLong_FromVoidPtr(stream))
                   : vkb_raise(state, &error);
}

PyObject *vkb_renderer_cuda_name(PyObject *object, PyObject *ordinal)
{
    const struct vkb_module_state *state = PyType_GetModuleState(Py_TYPE(object));
    const long number = PyLong_AsLong(ordinal);
    char name[VKB_CUDA_NAME_SIZE];
    struct vkb_error error = {0};

    if (PyErr_Occurred())
        return NULL;
    if (!open_exports((struct vkb_renderer *)object, &error))
        return vkb_raise(state, &error);
    VKB_LOCK(vkb_memory);
    const struct vkb_exports *exports = find_exports((struct vkb_renderer *)object, &error);
    if (exports)
        vkb_cuda_name(exports->cuda, (int)number, name);
    VKB_UNLOCK(vkb_memory);
    return exports ? PyUnicode_FromString(name) : vkb_raise(state, &error);
}

PyObject *vkb_renderer_in_context(PyObject *object, PyObject *function)
{
    const struct vkb_module_state *state = PyType_GetModuleState(Py_TYPE(object));
    struct vkb_error error = {0};
    PyObject *result = NULL;

    // The function may close the renderer, and so may other threads beside it.
    struct vkb_exports *exports = use_exports((struct vkb_renderer *)object, &error);
    if (!exports)
        return vkb_raise(state, &error);
    bool done =
        vkb_cuda_require_no_capture(exports->cuda, &error) && vkb_cuda_enter(exports->cuda, &error);
    if (done) {
        result = PyObject_CallObject(function, NULL);
        vkb_cuda_leave(exports->cuda);
        // A producer whose stream is captured takes this one into the capture.
        done = !result || vkb_cuda_require_no_capture(exports->cuda, &error);
    }
    vkb_release_exports(exports);
    if (done)
        return result;
    Py_XDECREF(result);
    return vkb_raise(state, &error);
}

// Begins the copy that CUDA is to make to the memory, if there is one, or makes it.
static bool fill(struct vkb_export *run, struct vkb_error *error)
{
    struct vkb_cuda *cuda = run->exports->cuda;
    bool done;

    if (run->origin_size == 0)
        return true;
    Py_BEGIN_ALLOW_THREADS
    done = vkb_cuda_begin_copy(cuda, &run->memory, run->origin, run->origin_size,
                               run->origin_stream, error);
    Py_END_ALLOW_THREADS
    VKB_LOCK(vkb_memory);
    const bool ordered = done && vkb_export_order_copy(run);
    VKB_UNLOCK(vkb_memory);
    if (done && !ordered) {
        Py_BEGIN_ALLOW_THREADS
        done = vkb_cuda_end_copy(cuda, &run->memory, error);
        Py_END_ALLOW_THREADS
    }
    run->origin_size = done ? 0 : run->origin_size;
    return done;
}

bool vkb_fill_exported(void *context, struct vkb_export *exported, struct vkb_error *error)
{
    struct vkb_renderer *renderer = context;

    PyEval_RestoreThread(renderer->thread);
    const bool done = fill(exported, error);
    renderer->thread = PyEval_SaveThread();
    return done;
}

PyObject *vkb_renderer_snapshot(PyObject *object, PyObject *arguments)
{
    unsigned long long address, stream = 0;
    Py_ssize_t size;
    int later = false;
    struct vkb_error error = {0};

    if (!PyArg_ParseTuple(arguments, "Kn|Kp:snapshot", &address, &size, &stream, &later)
        || !vkb_check_bytes("snapshot", size))
        return NULL;
    struct exported_object *self = new_exported((struct vkb_renderer *)object, size);
    if (!self)
        return NULL;
    self->run->origin = address;
    self->run->origin_size = (size_t)size;
    self->run->origin_stream = (void *)(uintptr_t)stream;
    if (later || fill(self->run, &error))
        return (PyObject *)self;
    Py_DECREF(self);
    return vkb_raise(PyType_GetModuleState(Py_TYPE(object)), &error);
}

// Orders a stream of CUDA, NULL: the renderer's, after what the device draws to the memory.
static bool order_stream(const struct exported_object *self, void *stream, struct vkb_error *error)
{
    if (!fill(self->run, error))
        return false;
    VKB_LOCK(vkb_memory);
    const bool done = vkb_export_drawn(self->run, stream, error);
    VKB_UNLOCK(vkb_memory);
    return done;
}

static PyObject *finish(PyObject *object, bool done, const struct vkb_error *error)
{
    return done ? Py_NewRef(Py_None) : vkb_raise(PyType_GetModuleState(Py_TYPE(object)), error);
}

static PyObject *complete(PyObject *object, PyObject *unused)
{
    struct exported_object *self = exported_of(object);
    struct vkb_error error = {0};

    (void)unused;
    VKB_LOCK(vkb_memory);
    const bool waits = self->run->drawn;
    bool done = vkb_export_drawn(self->run, NULL, &error);
    VKB_UNLOCK(vkb_memory);
    if (done && waits) {
        Py_BEGIN_ALLOW_THREADS
        done = vkb_cuda_finish(self->exports->cuda, &error);
        Py_END_ALLOW_THREADS
        VKB_LOCK(vkb_memory);
        self->run->drawn = done ? 0 : self->run->drawn;
        VKB_UNLOCK(vkb_memory);
    }
    return finish(object, done, &error);
}

// Whether the bytes lie in the memory; else a ValueError is set.
static bool check_part(const struct exported_object *self, const char *name, Py_ssize_t offset,
                       Py_ssize_t size)
{
    const uint64_t whole = self->run->size;

    return (offset >= 0 && size >= 0 && (uint64_t)offset <= whole
            && (uint64_t)size <= whole - (uint64_t)offset)
        || vkb_refuse("%s: %zd bytes from byte %zd on lie outside of the memory of %llu bytes",
                      name, size, offset, (unsigned long long)whole);
}

// Whether a dense array of that shape lies in the memory.
static bool check_shape(const struct exported_object *self, PyObject *shape, int bits,
                        Py_ssize_t offset)
{
    const Py_ssize_t sides = PyTuple_Size(shape), most = PY_SSIZE_T_MAX;
    Py_ssize_t size = bits / 8;

    if (sides > VKB_MAX_DIMENSIONS || bits < 8 || bits > 64 || bits % 8)
        return vkb_refuse("capsule: %zd dimensions of numbers of %d bits are out of range", sides,
                          bits);
    for (Py_ssize_t i = 0; i < sides; ++i) {
        const Py_ssize_t side = PyLong_AsSsize_t(PyTuple_GetItem(shape, i));
        if (PyErr_Occurred())
            return false;
        if (side < 1 || size > most / side)
            return vkb_refuse("capsule: a side of %zd is out of range", side);
        size *= side;
    }
    return check_part(self, "capsule", offset, size);
}

static PyObject *make_capsule(PyObject *object, PyObject *arguments)
{
    struct exported_object *self = exported_of(object);
    PyObject *shape;
    int code, bits, versioned;
    Py_ssize_t offset;
    unsigned long long stream;
    struct vkb_error error = {0};

    if (!PyArg_ParseTuple(arguments, "O!iipnK:capsule", &PyTuple_Type, &shape, &code, &bits,
                          &versioned, &offset, &stream)
        || !check_shape(self, shape, bits, offset))
        return NULL;
    if (!order_stream(self, (void *)(uintptr_t)stream, &error))
        return vkb_raise(PyType_GetModuleState(Py_TYPE(object)), &error);
    const struct vkb_tensor tensor = {
        .data = (void *)(uintptr_t)address_of(self, offset),
        .device = {VKB_DEVICE_CUDA, vkb_cuda_ordinal(self->exports->cuda)},
        .ndim = (int32_t)PyTuple_Size(shape),
        .dtype = {(uint8_t)code, (uint8_t)bits, 1},
    };
    return vkb_dlpack_capsule(object, &tensor, shape, versioned);
}

// Copies bytes between the memory and other memory, after what the device draws to it, and waits.
static bool copy_bytes(const struct exported_object *self, vkb_cuda_address to,
                       vkb_cuda_address from, Py_ssize_t size, struct vkb_error *error)
{
    bool done = order_stream(self, NULL, error);

    Py_BEGIN_ALLOW_THREADS
    done = done && vkb_cuda_copy(self->exports->cuda, to, from, (size_t)size, error);
    Py_END_ALLOW_THREADS
    return done;
}

static PyObject *copy_between(PyObject *object, PyObject *arguments)
{
    struct vkb_error error = {0};
    unsigned long long to, from;
    Py_ssize_t size;

    if (!PyArg_ParseTuple(arguments, "KKn:copy_bytes", &to, &from, &size))
        return NULL;
    // One of both ends is this memory.
    const vkb_cuda_address start = address_of(exported_of(object), 0);
    const uint64_t whole = exported_of(object)->run->size;
    const bool writes = to >= start && to - start <= whole;
    const uint64_t at = writes ? to - start : from - start;
    if (at > whole || size < 0 || (uint64_t)size > whole - at) {
        vkb_refuse("copy_bytes: %zd bytes lie outside of the memory of %llu bytes", size,
                   (unsigned long long)whole);
        return NULL;
    }
    if (writes) {
        VKB_LOCK(vkb_memory);
        vkb_export_renew(exported_of(object)->run);
        VKB_UNLOCK(vkb_memory);
    }
    const bool done = copy_bytes(exported_of(object), to, from, size, &error);
    return finish(object, done, &error);
}

static PyObject *clone_export(PyObject *object, PyObject *arguments)
{
    struct exported_object *self = exported_of(object);
    Py_ssize_t size, offset;
    struct vkb_error error = {0};

    if (!PyArg_ParseTuple(arguments, "nn:clone", &size, &offset) || !vkb_check_bytes("clone", size)
        || !check_part(self, "clone", offset, size))
        return NULL;
    struct exported_object *other = vkb_new_object((PyObject *)Py_TYPE(object));
    if (!other)
        return NULL;
    other->process = self->process;
    VKB_LOCK(vkb_memory);
    ++self->exports->users;
    VKB_UNLOCK(vkb_memory);
    other->exports = self->exports;
    if (take_memory(other, size, &error)
        && copy_bytes(self, address_of(other, 0), address_of(self, offset), size, &error))
        return (PyObject *)other;
    Py_DECREF(other);
    return vkb_raise(PyType_GetModuleState(Py_TYPE(object)), &error);
}

static PyObject *get_address(PyObject *object, void *unused)
{
    (void)unused;
    return PyLong_FromUnsignedLongLong(address_of(exported_of(object), 0));
}

static PyObject *get_ordinal(PyObject *object, void *unused)
{
    (void)unused;
    return PyLong_FromLong(vkb_cuda_ordinal(exported_of(object)->exports->cuda));
}

static PyMethodDef methods[] = {
    {"capsule", make_capsule, METH_VARARGS,
     "capsule(shape, code, bits, versioned, offset, stream) -> a capsule of DLPack. The stream "
     "waits for the device; 0: the renderer's."},
    {"complete", complete, METH_NOARGS, "complete(). Waits until the device has drawn to it."},
    {"copy_bytes", copy_between, METH_VARARGS,
     "copy_bytes(to, from, size). Between addresses of this memory and of the host or the GPU, "
     "after "
     "what the device draws to it; waits."},
    {"clone", clone_export, METH_VARARGS,
     "clone(size, offset) -> Exported. A copy of so many bytes."},
    {0},
};

static PyGetSetDef attributes[] = {
    {"address", get_address, NULL, "The address for CUDA.", NULL},
    {"ordinal", get_ordinal, NULL, "CUDA's number of the GPU.", NULL},
    {0},
};

static PyType_Slot slots[] = {
    {Py_tp_dealloc, dealloc},
    {Py_tp_methods, methods},
    {Py_tp_getset, attributes},
    {Py_tp_doc, "Memory of a renderer's device that CUDA shares."},
    {0},
};

// No garbage collection: it holds no references to objects.
PyType_Spec vkb_exported_spec = {
    .name = "vkbloom._core.Exported",
    .basicsize = sizeof(struct exported_object),
    .flags = VKB_TYPE_FLAGS,
    .slots = slots,
};
