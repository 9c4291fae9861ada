// Passes as commands: parameters, descriptors, transitions, draws and dispatches.
#ifndef VKB_RECORD_H
#define VKB_RECORD_H

#include "run/frame.h"

// The state of one submission, and of the point that is being recorded.
struct vkb_run {
    struct vkb_device *device;
    struct vkb_frame *frame;
    struct vkb_flight *flight;
    struct vkb_point *point;
    const struct vkb_graph *graph;  // the point's
    struct vkb_slot **slots;        // by the graph's image index
    bool *wanted;                   // by image
    bool *needed, *current;         // by pass
    struct vkb_slot *input;         // NULL: none
    bool send_input;                // the device does not have it yet
    unsigned char *recipe;
    size_t recipe_size, recipe_capacity;
};

// Records the passes first..end-1, which have the same targets, and notes that these are made by
// run->recipe. A dispatch is a group of its own.
bool vkb_record_group(struct vkb_run *run, uint32_t first, uint32_t end, struct vkb_slot **targets,
                      uint32_t target_count, struct vkb_error *error);

#endif
