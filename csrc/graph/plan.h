// A plan is a graph and its requested framebuffers. A planner determines which of its passes must
// run: the passes that the framebuffers need and that are out of date.
#ifndef VKB_PLAN_H
#define VKB_PLAN_H

#include "graph/graph.h"

struct vkb_plan {
    struct vkb_graph graph;
    uint32_t *outputs;  // images of the graph, in its order
    uint32_t output_count;
    uint64_t size;  // bytes of the images that the outputs need (vkb_plan_measure)
};

void vkb_plan_destroy(struct vkb_plan *plan);

// The content of an image, described by what it was made from.
struct vkb_content {
    uint64_t version;       // new each time that the image is written
    unsigned char *recipe;  // without padding, to be compared with memcmp
    size_t recipe_size, recipe_capacity;
    bool valid;     // once the device has run all recorded commands, the image matches the recipe
    bool repeated;  // the writing before had the same recipe
};

// Makes the content invalid and gives it a new recipe and version. The caller sets `valid` once it
// has recorded the passes that write the image. The clock counts the versions.
bool vkb_content_begin_writing(struct vkb_content *content, uint64_t *clock, const void *recipe,
                               size_t size, struct vkb_error *error);

// Whether it is valid, and made by that recipe. `content` may be NULL.
bool vkb_content_holds(const struct vkb_content *content, const void *recipe, size_t size);

// A plan within the sequence of plans that a renderer runs.
struct vkb_plan_step {
    const struct vkb_plan *plan;
    const struct vkb_graph *next;   // graph of the next plan with the same source; NULL: not known
    struct vkb_content **contents;  // by image; NULL: there is no cached image
    bool unfused;                   // no fused pass may run
    uint64_t source;                // version of the source's data
    uint64_t scene;                 // serial of the meshes and textures that draws read
};

// A row without padding, by vkb_pass_pack. It refers to no shader object, which may be gone.
struct vkb_packed_pass {
    size_t size;
    unsigned char bytes[sizeof(struct vkb_pass_row)];
};

// The planner's result for the last plan, and that plan's passes.
struct vkb_planner {
    bool *current;  // by pass: its images are up to date
    bool *needed;   // by pass: a requested framebuffer needs it
    bool *wanted;   // by image: a requested framebuffer, or read or written by a needed pass
    unsigned char *recipe;
    size_t current_capacity, needed_capacity, wanted_capacity, recipe_size, recipe_capacity;
    struct vkb_packed_pass *previous;
    size_t previous_count, previous_capacity;
    uint64_t previous_source;
};

// Finds the plan's size in memory; and that where images share memory, which takes longer to find.
// Images of passes that fused ones may replace count, too.
bool vkb_plan_measure(struct vkb_plan *plan, struct vkb_error *error);
bool vkb_plan_shared_size(const struct vkb_plan *plan, uint64_t *size, struct vkb_error *error);

// Whether the plan's outputs, or passes from `first` on that the planner has marked to run, need
// the content that an image has before pass `first`, or that this pass writes. The writing passes
// of one that is written again come before its readers.
bool vkb_planner_reads(const struct vkb_planner *planner, const struct vkb_plan *plan,
                       uint32_t image, uint32_t first);

// Destroying a zeroed or half-created planner is safe.
void vkb_planner_destroy(struct vkb_planner *planner);

// Marks the passes that the step's framebuffers need, and the images that these passes read or
// write. A fused pass, with those that go on in place, replaces the group before it if fewer passes
// run then. It does not if the plan before or after shares all passes that it would save: in a
// sequence, shared passes run once, and then only the passes that change.
bool vkb_planner_mark(struct vkb_planner *planner, const struct vkb_plan_step *step,
                      struct vkb_error *error);

// Records passes first..end-1, which have the same targets.
typedef bool vkb_record(void *context, uint32_t first, uint32_t end, struct vkb_error *error);

// Calls `record` for each group of passes that is needed and out of date, in the graph's order.
// Every wanted image must have a content.
bool vkb_planner_run(struct vkb_planner *planner, const struct vkb_plan_step *step, uint64_t *clock,
                     vkb_record *record, void *context, struct vkb_error *error);

#endif
