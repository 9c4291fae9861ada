// DLPack's structs: https://dmlc.github.io/dlpack/latest/c_api.html
#include "python/dlpack.h"
#include "python/module.h"

struct managed {
    struct vkb_tensor tensor;
    void *context;
    void (*deleter)(struct managed *self);
};

struct versioned {
    struct {
        uint32_t major, minor;
    } version;
    void *context;
    void (*deleter)(struct versioned *self);
    uint64_t flags;
    struct vkb_tensor tensor;
};

#define NAME           "dltensor"
#define VERSIONED_NAME "dltensor_versioned"

// What an exported capsule owns.
struct shared {
    PyObject *owner;
    int64_t shape[VKB_MAX_DIMENSIONS], strides[VKB_MAX_DIMENSIONS];
    struct managed managed;
    struct versioned versioned;
};

static PyObject *numbers(const int64_t *values, int32_t count)
{
    PyObject *tuple = PyTuple_New(count);

    for (int32_t i = 0; tuple && i < count; ++i)
        if (!vkb_set_item(tuple, i, PyLong_FromLongLong(values[i])))
            Py_CLEAR(tuple);
    return tuple;
}

PyObject *vkb_read_dlpack(PyObject *module, PyObject *capsule)
{
    const struct vkb_tensor *tensor;

    (void)module;
    if (PyCapsule_IsValid(capsule, VERSIONED_NAME)) {
        struct versioned *versioned = PyCapsule_GetPointer(capsule, VERSIONED_NAME);
        if (versioned->version.major != 1) {
            PyErr_Format(PyExc_BufferError, "DLPack: version %u is not 1",
                         versioned->version.major);
            return NULL;
        }
        tensor = &versioned->tensor;
    } else {
        struct managed *managed = PyCapsule_GetPointer(capsule, NAME);
        if (!managed)
            return NULL;
        tensor = &managed->tensor;
    }
    if (tensor->ndim < 0 || (tensor->ndim > 0 && !tensor->shape)) {
        PyErr_Format(PyExc_BufferError, "DLPack: %d dimensions without a shape", (int)tensor->ndim);
        return NULL;
    }
    return Py_BuildValue(
        "(K(ii)(iii)NN)", (unsigned long long)(uintptr_t)tensor->data + tensor->byte_offset,
        (int)tensor->device.type, (int)tensor->device.id, (int)tensor->dtype.code,
        (int)tensor->dtype.bits, (int)tensor->dtype.lanes, numbers(tensor->shape, tensor->ndim),
        tensor->strides ? numbers(tensor->strides, tensor->ndim) : Py_NewRef(Py_None));
}

// Consumers call these in any thread, with or without the GIL, and maybe after Python has ended.
static void release_shared(struct shared *shared)
{
    if (!Py_IsInitialized())
        return;
    const PyGILState_STATE state = PyGILState_Ensure();
    Py_DECREF(shared->owner);
    vkb_free(shared);
    PyGILState_Release(state);
}

static void delete_managed(struct managed *self)
{
    release_shared(self->context);
}

static void delete_versioned(struct versioned *self)
{
    release_shared(self->context);
}

// A capsule that was consumed has another name.
static void destroy_capsule(PyObject *capsule)
{
    if (PyCapsule_IsValid(capsule, NAME)) {
        struct managed *managed = PyCapsule_GetPointer(capsule, NAME);
        managed->deleter(managed);
    } else if (PyCapsule_IsValid(capsule, VERSIONED_NAME)) {
        struct versioned *versioned = PyCapsule_GetPointer(capsule, VERSIONED_NAME);
        versioned->deleter(versioned);
    }
}

PyObject *vkb_dlpack_capsule(PyObject *owner, const struct vkb_tensor *array, PyObject *shape,
                             bool versioned)
{
    struct vkb_tensor tensor = *array;
    struct vkb_error error;
    struct shared *shared = vkb_alloc(&error, 1, sizeof *shared);
    int64_t stride = 1;

    if (!shared)
        return vkb_raise(PyType_GetModuleState(Py_TYPE(owner)), &error);
    for (int32_t i = tensor.ndim - 1; i >= 0; --i) {
        shared->shape[i] = PyLong_AsLongLong(PyTuple_GetItem(shape, i));
        shared->strides[i] = stride;
        stride *= shared->shape[i];
    }
    tensor.shape = shared->shape;
    tensor.strides = shared->strides;
    shared->owner = Py_NewRef(owner);
    shared->managed = (struct managed){tensor, shared, delete_managed};
    shared->versioned = (struct versioned){{1, 0}, shared, delete_versioned, 0, tensor};
    PyObject *capsule = versioned
                          ? PyCapsule_New(&shared->versioned, VERSIONED_NAME, destroy_capsule)
                          : PyCapsule_New(&shared->managed, NAME, destroy_capsule);
    if (!capsule)
        release_shared(shared);
    return capsule;
}
