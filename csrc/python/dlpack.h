// Capsules of DLPack: those of producers, and those that the core makes.
#ifndef VKB_PYTHON_DLPACK_H
#define VKB_PYTHON_DLPACK_H

#include "python/objects.h"

enum {
    VKB_DEVICE_CUDA = 2,  // kDLCUDA
    VKB_MAX_DIMENSIONS = 4,
};

// DLPack's DLTensor.
struct vkb_tensor {
    void *data;
    struct {
        int32_t type, id;
    } device;
    int32_t ndim;
    struct {
        uint8_t code, bits;
        uint16_t lanes;
    } dtype;
    int64_t *shape, *strides;
    uint64_t byte_offset;
};

// Makes a capsule of a dense array of that shape, of up to VKB_MAX_DIMENSIONS sides. The capsule
// holds the owner of the memory until its consumer lets go.
PyObject *vkb_dlpack_capsule(PyObject *owner, const struct vkb_tensor *array, PyObject *shape,
                             bool versioned);

#endif
