// Runs graphs: what is out of date is recorded, timed and submitted; later it is waited for, and
// the images that are wanted come back to the host.
#ifndef VKB_FRAME_H
#define VKB_FRAME_H

#include "graph/plan.h"
#include "run/image_cache.h"
#include "run/pipeline.h"
#include "run/resident.h"
#include "run/submission.h"
#include "scene/scene.h"

// Everything that lives from frame to frame. What the submissions share is changed by the device in
// the order of the submissions, and by the host only when nothing is pending.
struct vkb_frame {
    struct vkb_submissions submissions;
    struct vkb_pipelines pipelines;
    struct vkb_scene scene;
    struct vkb_upload uploads[VKB_INPUT_COUNT];  // by kind
    struct vkb_buffer constants;                 // staging memory of images that are filled once
    struct vkb_image_cache cache;
    struct vkb_planner planner;
    uint64_t submitted;  // submissions so far
    bool stale;          // something failed: the images are made anew before anything is recorded
};

// What graphs start from; what they do not use is NULL.
struct vkb_frame_source {
    const struct vkb_scene_data *scene;
    const struct vkb_input *inputs[VKB_INPUT_COUNT];  // by kind
    struct vkb_resident *resident;                    // in place of them
};

struct vkb_timing {
    char name[VKB_NAME_SIZE];
    double seconds;  // NaN: the queue has no timestamps
};

// Destroying a zeroed or half-built object is fine, one that submissions were submitted with only
// after vkb_frame_end.
bool vkb_frame_create(const struct vkb_device *device, const void *cache_data, size_t cache_size,
                      struct vkb_frame *frame, struct vkb_error *error);
void vkb_frame_destroy(const struct vkb_device *device, struct vkb_frame *frame);

// One source with one settings, as a plan of its own. `outputs` are the plan's, in its order;
// `timings` has room for every pass of the graph and gets the render passes that ran. All of it,
// the plan too, must stay where it is until the submission is over.
struct vkb_request {
    const struct vkb_plan *plan;
    struct vkb_output *outputs;
    struct vkb_timing *timings;
    uint32_t timing_count;
    uint32_t first_span;  // of its timings, in the submission's timer
};

// Records what the requests' outputs need and is out of date, request after request, and hands it
// to the device. All requests have the same images (vkb_graph_same_images). The source is read
// before this returns. A failure leaves no submission, the frame usable, unless the device is lost,
// and earlier submissions as they were.
bool vkb_frame_submit(struct vkb_device *device, struct vkb_frame *frame,
                      const struct vkb_frame_source *source, struct vkb_request *requests,
                      uint32_t request_count, struct vkb_submission **submission,
                      struct vkb_error *error);

// Waits for the submission and fills its requests' outputs and timings. *over: whether the device
// is done with it, which it need not be after a failure.
bool vkb_frame_collect(struct vkb_device *device, struct vkb_frame *frame,
                       struct vkb_submission *submission, bool *over, struct vkb_error *error);

// How many NaN and infinities the source's image holds; after it was submitted.
struct vkb_specials vkb_frame_specials(const struct vkb_frame *frame,
                                       const struct vkb_frame_source *source);

// Gives up a submission that nobody wants any more, without a wait; false where the device may
// still be at work on it.
bool vkb_frame_drop(struct vkb_device *device, struct vkb_frame *frame,
                    struct vkb_submission *submission);

// What is cached.
struct vkb_cached {
    size_t pipelines, framebuffers;
    uint64_t image_bytes;
};
struct vkb_cached vkb_frame_cached(const struct vkb_frame *frame);

// Waits for all submissions for the last time, no longer than a frame may take for each. False
// where the frame cannot be destroyed: the wait was interrupted, or the device is at work still.
bool vkb_frame_end(struct vkb_device *device, struct vkb_frame *frame, struct vkb_error *error);

#endif
