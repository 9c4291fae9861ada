// A submission, with everything that its commands use until the device has run them. Several can be
// pending, so that the device runs one while the host reads the results of another.
#ifndef VKB_SUBMISSION_H
#define VKB_SUBMISSION_H

#include "execute/descriptors.h"
#include "graph/graph.h"
#include "transfer/readback.h"
#include "vulkan/commands.h"
#include "vulkan/timing.h"

struct vkb_submission {
    struct vkb_commands commands;
    struct vkb_buffer uniforms;
    VkDeviceSize uniform_used;
    struct vkb_descriptors descriptors;
    struct vkb_timer timer;
    struct vkb_readback readback;
    struct vkb_image inputs[VKB_INPUT_COUNT];  // the caller's, which it reads in place; by kind
    uint64_t number;                           // submissions are numbered from 1
    struct vkb_request *requests;              // owned by the caller
    uint32_t request_count;
    bool taken;    // in use: not given back yet
    bool pending;  // the device may still run it, even if it was abandoned
};

struct vkb_submissions {
    struct vkb_submission **submissions;  // pointers, since the elements must not move
    size_t count, capacity;
};

// Destroys all submissions, also those in use. If there were submissions, call vkb_submissions_end
// first.
void vkb_submissions_destroy(const struct vkb_device *device, struct vkb_submissions *submissions);

// Takes an unused submission. It is ready for vkb_commands_begin.
bool vkb_submissions_take(const struct vkb_device *device, struct vkb_submissions *submissions,
                          struct vkb_submission **submission, struct vkb_error *error);
// A pending submission can be taken again when the device has finished it.
void vkb_submissions_give_back(const struct vkb_device *device, struct vkb_submissions *submissions,
                               struct vkb_submission *submission);

// The number of the first pending submission; `now` if there is none.
uint64_t vkb_submissions_pending(const struct vkb_submissions *submissions, uint64_t now);

// Whether the device has finished the submission, which then no longer is pending; does not wait.
bool vkb_submission_over(const struct vkb_device *device, struct vkb_submission *submission);

// Ends the recording and submits it. The device runs submissions in order. `order` may be NULL.
bool vkb_submission_submit(struct vkb_device *device, struct vkb_submission *submission,
                           const struct vkb_sync *order, struct vkb_error *error);
// Waits until the device has finished the submission and all before it. On failure it is still
// pending.
bool vkb_submission_wait(struct vkb_device *device, const struct vkb_submissions *submissions,
                         struct vkb_submission *submission, struct vkb_error *error);

// Waits for all pending submissions. After this the host can change what submissions share.
bool vkb_submissions_wait(struct vkb_device *device, struct vkb_submissions *submissions,
                          struct vkb_error *error);

// The same before everything is destroyed, also on a lost device. False if the device may still use
// what the submissions use, so that it cannot be destroyed.
bool vkb_submissions_end(struct vkb_device *device, struct vkb_submissions *submissions,
                         struct vkb_error *error);

#endif
