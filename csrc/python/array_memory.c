// NumPy arrays that own memory of a renderer's pages: NumPy gets it from here, and gives it back
// here when it frees the array, which may be long after the renderer.
//
// NumPy's way to that (NEP 49) is in its C API only. Two entries of that table are called by their
// place in it, which is fixed for all of NumPy 2, instead of building against NumPy's headers:
// the core goes without them otherwise. With another NumPy the arrays are as NumPy makes them.
#include "python/module.h"

#include "run/pages.h"
#include "run/readback.h"

#include <string.h>

// NumPy's PyDataMem_Handler, version 1.
struct data_handler {
    char name[127];
    uint8_t version;
    void *context;
    void *(*malloc)(void *context, size_t size);
    void *(*calloc)(void *context, size_t count, size_t size);
    void *(*realloc)(void *context, void *memory, size_t size);
    void (*free)(void *context, void *memory, size_t size);
};

struct vkb_array_memory {
    struct data_handler handler;
    struct vkb_pages pages;
    long process;
    PyObject *(*set_handler)(PyObject *handler);  // NumPy's PyDataMem_SetHandler
};

// Places in NumPy's table, and the ABI that has them there.
enum { GET_ABI = 0, SET_HANDLER = 304, NUMPY_ABI = 0x02000000 };

static void *take(void *context, size_t size)
{
    struct vkb_array_memory *memory = context;

    return vkb_pages_take(&memory->pages, size);
}

static void *take_zeroed(void *context, size_t count, size_t size)
{
    void *memory = size && count > SIZE_MAX / size ? NULL : take(context, count * size);

    return memory ? memset(memory, 0, count * size) : NULL;
}

// A forked process keeps its copies: runs go back to a device that is its parent's.
static void give_back(void *context, void *freed, size_t size)
{
    struct vkb_array_memory *memory = context;

    (void)size;
    if (freed && memory->process == vkb_current_process())
        vkb_pages_give_back(&memory->pages, freed);
}

static void *resize(void *context, void *old, size_t size)
{
    struct vkb_array_memory *memory = context;
    const struct vkb_page_run *run = old ? vkb_pages_find(&memory->pages, old) : NULL;
    void *resized = take(context, size);

    if (resized && run) {
        memcpy(resized, old, run->size < size ? run->size : size);
        give_back(context, old, 0);
    }
    return resized;
}

static const char capsule_name[] = "mem_handler";  // the one that NumPy asks for

static void release(PyObject *capsule)
{
    struct vkb_array_memory *memory = PyCapsule_GetPointer(capsule, capsule_name);

    // Every array holds the capsule, so that nobody has a run.
    vkb_free(memory);
}

static struct vkb_array_memory *memory_of(const struct vkb_renderer *renderer)
{
    return renderer->array_memory ? PyCapsule_GetPointer(renderer->array_memory, capsule_name)
                                  : NULL;
}

// NumPy's function; NULL without an exception where it is not known to be there.
static PyObject *(*find_set_handler(void))(PyObject *)
{
    PyObject *numpy = PyImport_ImportModule("numpy._core._multiarray_umath");
    PyObject *capsule = numpy ? PyObject_GetAttrString(numpy, "_ARRAY_API") : NULL;
    void **table = capsule ? PyCapsule_GetPointer(capsule, NULL) : NULL;
    PyObject *(*found)(PyObject *) = NULL;

    if (table && ((unsigned int (*)(void))table[GET_ABI])() == NUMPY_ABI)
        found = (PyObject * (*)(PyObject *)) table[SET_HANDLER];
    Py_XDECREF(capsule);
    Py_XDECREF(numpy);
    PyErr_Clear();
    return found;
}

// Run in a context, which the handler is for from then on.
static PyObject *use_memory(PyObject *capsule, PyObject *unused)
{
    const struct vkb_array_memory *memory = PyCapsule_GetPointer(capsule, capsule_name);
    PyObject *before = memory->set_handler(capsule);

    (void)unused;
    Py_XDECREF(before);
    return before ? Py_NewRef(Py_None) : NULL;
}

// A context in which arrays are made with the handler. The caller's never has it: whatever fails,
// nothing has to be put back there.
static PyObject *new_context(PyObject *capsule)
{
    static PyMethodDef method = {"use_memory", use_memory, METH_NOARGS, NULL};
    PyObject *contextvars = PyImport_ImportModule("contextvars");
    PyObject *context = contextvars ? PyObject_CallMethod(contextvars, "Context", NULL) : NULL;
    PyObject *use = context ? PyCFunction_New(&method, capsule) : NULL;
    PyObject *used = use ? PyObject_CallMethod(context, "run", "O", use) : NULL;

    if (!used)
        Py_CLEAR(context);
    Py_XDECREF(used);
    Py_XDECREF(use);
    Py_XDECREF(contextvars);
    return context;
}

bool vkb_array_memory_create(struct vkb_renderer *renderer)
{
    struct vkb_error error;
    struct vkb_array_memory *memory = vkb_alloc(&error, 1, sizeof *memory);

    if (!memory) {
        PyErr_NoMemory();
        return false;
    }
    *memory = (struct vkb_array_memory){
        .handler = {"vkbloom", 1, memory, take, take_zeroed, resize, give_back},
        .pages = {.device = &renderer->device},
        .process = vkb_current_process(),
        .set_handler = find_set_handler(),
    };
    renderer->array_memory = PyCapsule_New(memory, capsule_name, release);
    if (!renderer->array_memory) {
        vkb_free(memory);
        return false;
    }
    if (memory->set_handler)
        renderer->array_context = new_context(renderer->array_memory);
    return !memory->set_handler || renderer->array_context;
}

// Bytes of an element of that dtype, 0 where no framebuffer has it.
static size_t element_size(PyObject *dtype)
{
    for (int format = VKB_FORMAT_NONE + 1; PyUnicode_Check(dtype) && format < VKB_FORMAT_COUNT;
         ++format)
        if (PyUnicode_CompareWithASCIIString(dtype, vkb_formats[format].dtype) == 0)
            return vkb_formats[format].channel_size;
    return 0;
}

// Whether the device would write the array in place. Smaller ones come from NumPy, which keeps some
// of them, too.
static bool is_large(PyObject *shape, PyObject *dtype)
{
    double bytes = (double)element_size(dtype);

    for (Py_ssize_t i = 0, count = PyTuple_Size(shape); i < count; ++i)
        bytes *= PyLong_AsDouble(PyTuple_GetItem(shape, i));
    return bytes >= VKB_IMPORTED_BYTES;
}

// In a copy of the context, as only one thread at a time can run in one.
static PyObject *call_in_context(PyObject *context, PyObject *empty, PyObject *shape,
                                 PyObject *dtype)
{
    PyObject *copy = PyObject_CallMethod(context, "copy", NULL);
    PyObject *array = copy ? PyObject_CallMethod(copy, "run", "OOO", empty, shape, dtype) : NULL;

    Py_XDECREF(copy);
    return array;
}

PyObject *vkb_new_array(PyObject *object, PyObject *arguments)
{
    const struct vkb_renderer *renderer = (const struct vkb_renderer *)object;
    PyObject *empty, *shape, *dtype;

    if (!PyArg_ParseTuple(arguments, "OO!O:new_array", &empty, &PyTuple_Type, &shape, &dtype))
        return NULL;
    struct vkb_array_memory *memory = memory_of(renderer);
    if (!memory || !renderer->array_context || !is_large(shape, dtype))
        return PyErr_Occurred() ? NULL : PyObject_CallFunctionObjArgs(empty, shape, dtype, NULL);
    // Kept for the error, whatever becomes of the renderer.
    PyObject *capsule = Py_NewRef(renderer->array_memory);
    memory->pages.error.kind = VKB_OK;
    PyObject *array = call_in_context(renderer->array_context, empty, shape, dtype);
    if (!array && memory->pages.error.kind != VKB_OK) {
        PyErr_Clear();
        vkb_raise(PyType_GetModuleState(Py_TYPE(object)), &memory->pages.error);
    }
    Py_DECREF(capsule);
    return array;
}

struct vkb_page_run *vkb_array_pages(const struct vkb_renderer *renderer, const void *memory)
{
    const struct vkb_array_memory *array_memory = memory_of(renderer);

    return array_memory ? vkb_pages_find(&array_memory->pages, memory) : NULL;
}

void vkb_array_memory_close(struct vkb_renderer *renderer)
{
    struct vkb_array_memory *memory = memory_of(renderer);

    if (memory)
        vkb_pages_close(&memory->pages);
    Py_CLEAR(renderer->array_context);
    Py_CLEAR(renderer->array_memory);
}
