// Determines without a device which passes a sequence of plans would run: the planner that
// execute/frame.c uses, with images that consist of descriptions of their content only.
#ifndef VKB_DRY_RUN_H
#define VKB_DRY_RUN_H

#include "graph/plan.h"

struct vkb_dry_image {
    struct vkb_image_row row;
    struct vkb_content content;
};

// Zero-initialized; there are no images at first.
struct vkb_dry_run {
    struct vkb_dry_image **images;  // pointers, since contents must not move
    size_t count, capacity;
    uint64_t clock;
    uint64_t source,
        source_version;  // of the last plan: the caller's number, and the version of its input
    struct vkb_planner planner;
};

void vkb_dry_run_destroy(struct vkb_dry_run *dry_run);

// Runs the planner as if the plan were a submission of its own. `source` is a number that
// identifies the data of its source. `ran` has an element for each pass of the plan: ran[i] becomes
// true if a group of passes that starts with pass i would run.
bool vkb_dry_run_step(struct vkb_dry_run *dry_run, const struct vkb_plan *plan, uint64_t source,
                      bool *ran, struct vkb_error *error);

#endif
