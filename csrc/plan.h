// Which passes of a graph a run needs for its outputs, and which of two that stand for each other.
#ifndef VKB_PLAN_H
#define VKB_PLAN_H

#include "readback.h"
#include "slots.h"

// What was last planned where an alternative could take the place of several passes.
struct vkb_plan_memory {
    unsigned char *request;  // the passes that it would spare, what they read, the pass itself
    size_t size, capacity;
    size_t spared_size;  // the part of `request` before the pass itself
    bool alternative;
};

void vkb_plan_memory_destroy(struct vkb_plan_memory *memory);

// Marks the passes that the outputs need, and the images that those passes read or write, in arrays
// of the graph's counts. `slots` has the graph's input images, of which the versions are read.
//
// An alternative runs in place of the pass before it where nobody wants the images that it spares,
// unless the same of them are asked for once more: then they are worth making, for what comes after
// them is likely to change again.
bool vkb_plan(const struct vkb_graph *graph, struct vkb_slot *const *slots,
              const struct vkb_output *outputs, uint32_t output_count,
              struct vkb_plan_memory *memory, bool *needed, bool *wanted, struct vkb_error *error);

#endif
