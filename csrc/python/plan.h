// Sources and plans as Python objects.
#ifndef VKB_PYTHON_PLAN_H
#define VKB_PYTHON_PLAN_H

#include "graph/dry_run.h"
#include "python/arguments.h"
#include "python/renderer.h"

// An image is the caller's array, or one that stays on the device of a renderer.
struct vkb_source_object {
    PyObject_HEAD
    struct vkb_source source;
    struct vkb_contents_object *contents;           // of a scene
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
    uint64_t renderer;  // the number of that for which it is; 0: none
    PyObject *outputs;  // ((name, shape, dtype), ...)
    Py_buffer kernel, field_weights, field_places, dirt, meter_mask;
    struct vkb_held_passes passes;
};

// Whether `histories` is None, or has an image of the renderer or None for each history of the only
// plan; else with an exception set.
bool vkb_check_histories(const struct vkb_renderer *renderer, PyObject *histories, PyObject *plans);
// Makes the only request continue from such histories, which are not None. Returns a tuple of the
// sources that it makes for the next call.
PyObject *vkb_hold_histories(struct vkb_renderer *renderer, struct vkb_pending *pending,
                             PyObject *histories, struct vkb_frame_source *data);

// A list of (name, shader, reads, writes, variant, number of its render pass) of the passes that
// the next step of a sequence runs.
PyObject *vkb_passes_that_run(const struct vkb_module_state *state, struct vkb_dry_run *dry_run,
                              const struct vkb_plan *plan, uint64_t source);

// Size in bytes of an output in the caller's array.
size_t vkb_output_size(const struct vkb_plan *plan, uint32_t output);
// Of a batch: bytes from the output of an image to that of the next.
size_t vkb_layer_stride(const struct vkb_plan *plan, uint32_t output);

#endif
