// Sources and plans as Python objects.
#ifndef VKB_PYTHON_PLAN_H
#define VKB_PYTHON_PLAN_H

#include "python/arguments.h"
#include "python/renderer.h"

// An image is the caller's array, or one that stays on the device of a renderer.
struct vkb_source_object {
    PyObject_HEAD
    struct vkb_source source;
    struct vkb_held_scene scene;
    struct vkb_held_image images[VKB_INPUT_COUNT];  // by kind
    VKB_ATOMIC(struct vkb_resident *) resident;     // NULL: none, or taken by another source
    struct vkb_residents *residents;
    long process;  // whose device the resident image is on
};

// Whether the renderer can use the source; else with a ValueError set.
bool vkb_check_source(const struct vkb_renderer *renderer, const struct vkb_source_object *source);

struct vkb_plan_object {
    PyObject_HEAD
    struct vkb_source source;
    struct vkb_plan plan;
    uint64_t renderer;  // serial of its renderer; 0: none, for inspection only
    PyObject *outputs;  // ((name, shape, dtype), ...)
    struct vkb_held_kernel kernel, dirt;
    struct vkb_held_passes passes;
};

// Size in bytes of an output in the caller's array.
size_t vkb_output_size(const struct vkb_plan *plan, uint32_t output);
// Of a batch: bytes from the output of an image to that of the next.
size_t vkb_layer_stride(const struct vkb_plan *plan, uint32_t output);

struct vkb_cotangents;

// The derivatives that a plan is of.
struct vkb_portion {
    const struct vkb_cotangents *cotangents;
    uint32_t first;    // of the images of derivatives
    bool is_possible;  // whether all passes have adjoints
};

// Makes a plan; `renderer` is the serial of its renderer, or 0, and `portion` may be NULL. NULL
// with an exception set.
PyObject *vkb_new_plan(const struct vkb_module_state *state, const struct vkb_device *device,
                       enum vkb_variants variants, uint64_t renderer, PyObject *source,
                       PyObject *settings_object, struct vkb_settings *settings,
                       struct vkb_portion *portion, PyObject *names);

#endif
