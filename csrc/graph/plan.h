// A plan is a graph and the framebuffers that are wanted of it. A planner finds out which of its
// passes have to run: those that the framebuffers need, and whose images do not hold their result.
#ifndef VKB_PLAN_H
#define VKB_PLAN_H

#include "graph/graph.h"

struct vkb_plan {
    struct vkb_graph graph;
    uint32_t *outputs;  // images of the graph, in its order
    uint32_t output_count;
};

void vkb_plan_destroy(struct vkb_plan *plan);

// What an image was made from.
struct vkb_content {
    uint64_t version;       // given anew each time that the image is written
    unsigned char *recipe;  // byte by byte comparable
    size_t recipe_size, recipe_capacity;
    bool valid;     // once the device has run all that was recorded, it holds what the recipe says
    bool repeated;  // the writing before had the same recipe
};

// From here until the caller, having recorded the writing, sets `valid`, the image holds nothing
// that counts. The clock gives out the versions.
bool vkb_content_begin_writing(struct vkb_content *content, uint64_t *clock, const void *recipe,
                               size_t size, struct vkb_error *error);

// A plan in its place among those of a renderer.
struct vkb_plan_step {
    const struct vkb_plan *plan;
    const struct vkb_graph *next;   // of the plan after it, with the same source; NULL: not known
    struct vkb_content **contents;  // by image; NULL: the image is not there
    uint64_t source;                // version of what the graph starts from
    uint64_t scene;                 // serial of the meshes and textures that draws read
};

// What it found out about the last plan, and that plan's passes.
struct vkb_planner {
    bool *current;  // by pass: its images hold its result
    bool *needed;   // by pass: the framebuffers need it
    bool *wanted;   // by image: a framebuffer, or what a needed pass reads or writes
    unsigned char *recipe;
    size_t current_capacity, needed_capacity, wanted_capacity, recipe_size, recipe_capacity;
    struct vkb_graph previous;  // without images
    uint64_t previous_source;
};

// Destroying a zeroed or half-built object is fine.
void vkb_planner_destroy(struct vkb_planner *planner);

// Marks the passes that the step's framebuffers need, and the images that those passes read or
// write. A fused pass is taken in place of the pass before it where fewer passes have to run for
// it; but not where the plan before or after shares all that it spares, for another pass: what a
// sequence shares is made once, then only what changes.
bool vkb_planner_mark(struct vkb_planner *planner, const struct vkb_plan_step *step,
                      struct vkb_error *error);

// Records passes first..end-1, which have the same targets.
typedef bool vkb_record(void *context, uint32_t first, uint32_t end, struct vkb_error *error);

// Calls `record` for each group of passes that is needed and out of date, in the graph's order. The
// wanted images must be there.
bool vkb_planner_run(struct vkb_planner *planner, const struct vkb_plan_step *step, uint64_t *clock,
                     vkb_record *record, void *context, struct vkb_error *error);

#endif
