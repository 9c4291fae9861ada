// Runs graphs: records the passes that are out of date, with timestamps, and submits them. Later it
// waits for them and copies the requested images to the host.
#ifndef VKB_FRAME_H
#define VKB_FRAME_H

#include "execute/image_cache.h"
#include "execute/pipeline.h"
#include "execute/resources.h"
#include "execute/submission.h"
#include "graph/plan.h"
#include "scene/scene.h"
#include "share/strided_copy.h"
#include "transfer/resident.h"
#include "transfer/screen.h"

// Images that passes read where the caller has them, on devices that use the host's memory: without
// a copy, and so without anything that the next image could be compared with.
struct vkb_in_place {
    struct vkb_cached_image cached;  // its image belongs to a submission
    const void *memory;              // of the last such image; only its address is used
    struct vkb_non_finite non_finite;
};

// Everything that is kept from frame to frame. Submissions share it. The device changes it in the
// order of the submissions, the host only when no submission is pending.
struct vkb_frame {
    struct vkb_submissions submissions;
    struct vkb_pipelines pipelines;
    struct vkb_scene scene;
    struct vkb_upload uploads[VKB_INPUT_COUNT];  // by kind
    struct vkb_in_place in_place[VKB_INPUT_COUNT];
    struct vkb_strided_copies strided_copies;
    struct vkb_non_finite non_finite;  // of the inputs of the last submission
    uint64_t finite_version;           // of the content last counted on the device that is finite
    struct vkb_buffer constants;       // staging memory of images that are filled once
    struct vkb_image_cache cache;
    struct vkb_resources resources;
    struct vkb_planner planner;
    const void *compiled;  // the address of the graph whose pipelines were last created together
    uint64_t submitted;    // submissions so far
    struct vkb_screen *screens;
    bool stale;  // after a failure: the images are created again before the next recording
};

// The data of a source. Members that its graph does not use are NULL.
struct vkb_frame_source {
    const struct vkb_scene_data *scene;
    const struct vkb_input *inputs[VKB_INPUT_COUNT];  // by kind
    struct vkb_resident *resident;  // instead of inputs: images that are on the device
    // What a call before has made of the framebuffers that have a history, in the order of the
    // graph's histories; NULL: zeros.
    struct vkb_resident *histories[VKB_MAX_HISTORIES];
    // The inputs do not change until the device has run the submission, so that it may read them
    // where they are.
    bool in_place;
    // Begins the copy that CUDA is to make to an exported input. Called when all earlier
    // submissions have ended, just before this one is submitted: beside the device's passes, CUDA
    // would take the GPU in slices of time.
    bool (*fill)(void *context, struct vkb_export *exported, struct vkb_error *error);
    void *context;
};

struct vkb_timing {
    char name[VKB_NAME_SIZE];
    double seconds;  // NaN: the queue has no timestamps
};

// Destroying a zeroed or half-created object is safe. After a submission, call vkb_frame_end first.
bool vkb_frame_create(const struct vkb_device *device, const void *cache_data, size_t cache_size,
                      struct vkb_frame *frame, struct vkb_error *error);
void vkb_frame_destroy(const struct vkb_device *device, struct vkb_frame *frame);

// One source with one Settings, as a plan. `outputs` has an element for each output of the plan, in
// its order. `timings` has space for every pass of the graph; it gets the render passes and
// dispatches that ran. The request and its plan must not move until the submission is finished.
struct vkb_request {
    const struct vkb_plan *plan;
    struct vkb_output *outputs;
    struct vkb_timing *timings;
    uint32_t timing_count;
    uint32_t first_stamp;                     // of its timings, in the submission's timer
    struct vkb_non_finite non_finite;         // of the inputs; complete after the submission
    struct vkb_non_finite *layer_non_finite;  // of each image of a batch; NULL: it is none
    // Get the images of these framebuffers for the next call; NULL: there is none.
    struct vkb_resident *kept[VKB_MAX_HISTORIES];
};

// Records the passes that the requests' outputs need and that are out of date, request after
// request, and submits them. All requests must have the same images (vkb_graph_same_images). The
// source is read before this returns. With `show`, presents the output of one request; if the
// surface has no image, there is no submission. After a failure there is none either, unless the
// presentation failed; earlier submissions are unchanged, and the frame is usable unless the device
// is lost.
bool vkb_frame_submit(struct vkb_device *device, struct vkb_frame *frame,
                      const struct vkb_frame_source *source, struct vkb_request *requests,
                      uint32_t request_count, struct vkb_show *show,
                      struct vkb_submission **submission, struct vkb_error *error);

// Waits for the submission and fills its requests' outputs and timings. *over becomes true if the
// device has finished it, which is not always so after a failure.
bool vkb_frame_collect(struct vkb_device *device, struct vkb_frame *frame,
                       struct vkb_submission *submission, bool *over, struct vkb_error *error);

// Releases an abandoned submission without a wait. False if the device may still run it.
bool vkb_frame_drop(struct vkb_device *device, struct vkb_frame *frame,
                    struct vkb_submission *submission);

// The number of cached objects, their size, and how often memory was allocated for images so far.
struct vkb_cached {
    size_t pipelines;
    uint64_t image_bytes, allocations;
};
struct vkb_cached vkb_frame_cached(const struct vkb_frame *frame);

// Waits for all submissions before the frame is destroyed, for each no longer than a frame may
// take. False if the frame cannot be destroyed: the wait was interrupted, or the device is still
// busy.
bool vkb_frame_end(struct vkb_device *device, struct vkb_frame *frame, struct vkb_error *error);

#endif
