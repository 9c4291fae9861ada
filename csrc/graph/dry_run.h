// Which passes a sequence of plans would run, found out without a device: the planner of
// run/frame.c over images that hold nothing but what they would have been made from.
#ifndef VKB_DRY_RUN_H
#define VKB_DRY_RUN_H

#include "graph/plan.h"

struct vkb_dry_image {
    struct vkb_image_row row;
    struct vkb_content content;
};

// Starts zeroed, with no images.
struct vkb_dry_run {
    struct vkb_dry_image **images;  // pointers, so that they stay where they are
    size_t count, capacity;
    uint64_t clock;
    uint64_t source, source_version;  // of the last plan: as given, and of the input that it has
    struct vkb_planner planner;
};

void vkb_dry_run_destroy(struct vkb_dry_run *dry_run);

// Plays the plan as if its framebuffers were rendered alone, one request a submission. `source` is
// a number by which to tell its data from other data. ran[i], of as many as the plan has passes:
// whether a group of passes that starts with pass i runs.
bool vkb_dry_run_step(struct vkb_dry_run *dry_run, const struct vkb_plan *plan, uint64_t source,
                      bool *ran, struct vkb_error *error);

#endif
