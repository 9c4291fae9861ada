// Passes as commands: parameters, descriptors, transitions, draws and dispatches.
#ifndef VKB_RECORD_H
#define VKB_RECORD_H

#include "execute/frame.h"

// An input of the source, and how its pixels come to the device (sources.c).
struct vkb_staged_input {
    const struct vkb_source_way *way;
    struct vkb_cached_image *image;  // NULL: there is no such input
    struct vkb_upload *upload;
    struct vkb_resident *resident;  // whose image it is; NULL: it is none
    const struct vkb_input *input;  // in memory that CUDA shares
    bool send;                      // the device does not have the pixels yet
    enum vkb_access access;         // of a resident image before the submission
};

// The state of one submission, and of the request that is being recorded.
struct vkb_run {
    struct vkb_device *device;
    struct vkb_frame *frame;
    struct vkb_submission *submission;
    struct vkb_show *show;  // NULL: nothing is presented
    struct vkb_request *request;
    const struct vkb_graph *graph;                    // the request's
    struct vkb_cached_image **images;                 // by the graph's image index
    struct vkb_content **contents;                    // of the cache
    VkImageUsageFlags *usages;                        // by image: what all requests need
    struct vkb_staged_input inputs[VKB_INPUT_COUNT];  // by kind
    bool shares;                                      // images share memory (transient.h)
    bool unknown_non_finite;  // whether the source has NaN or infinity is counted on the device
    struct vkb_sync sync;     // what the submission waits for and signals
};

// A place where framebuffers go; frame.c has a list of all. Functions may be NULL.
struct vkb_sink {
    // Before the commands are recorded: memory, and an image of the surface.
    bool (*prepare)(struct vkb_run *run, struct vkb_request *requests, uint32_t request_count,
                    struct vkb_error *error);
    // After the passes of run->request.
    bool (*record)(struct vkb_run *run, struct vkb_error *error);
    // After the submission.
    bool (*finish)(struct vkb_run *run, const struct vkb_request *requests, uint32_t request_count,
                   struct vkb_error *error);
};
extern const struct vkb_sink vkb_host_sink, vkb_cuda_sink, vkb_screen_sink;

// Creates the pipelines of the request's passes that are going to run, at the same time.
void vkb_record_pipelines(struct vkb_run *run);

// The planner calls this for each group of passes that has to run. `context` is a struct vkb_run.
vkb_record vkb_record_group;

#endif
