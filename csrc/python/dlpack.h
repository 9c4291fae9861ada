// Capsules of DLPack: those of producers, and those that the core makes.
#ifndef VKB_PYTHON_DLPACK_H
#define VKB_PYTHON_DLPACK_H

#include "python/objects.h"

// A dense array on a GPU.
struct vkb_dlpack_array {
    PyObject *owner;  // which keeps the memory
    uintptr_t address;
    int ordinal;  // CUDA's number of the GPU
    uint8_t code, bits;
};

// Makes a capsule that holds the owner until its consumer lets go.
PyObject *vkb_dlpack_capsule(const struct vkb_dlpack_array *array, PyObject *shape, bool versioned);

#endif
