// A submission, with everything that its commands use until the device has run them. Several can be
// pending at once, so that the device works on one while the host reads another.
#ifndef VKB_SUBMISSION_H
#define VKB_SUBMISSION_H

#include "run/readback.h"
#include "vulkan/commands.h"
#include "vulkan/timing.h"

struct vkb_submission {
    struct vkb_commands commands;
    struct vkb_buffer uniforms;
    VkDeviceSize uniform_used;
    VkDescriptorPool descriptors;
    uint32_t descriptor_capacity;  // in sets
    struct vkb_timer timer;
    struct vkb_readback readback;
    uint64_t number;               // of the submission; they count up
    struct vkb_request *requests;  // what it runs; the submitter's
    uint32_t request_count;
    bool taken;    // by a submitter that has not given it back
    bool pending;  // the device may still be at work on it, also where nobody waits any more
};

struct vkb_submissions {
    struct vkb_submission **submissions;  // pointers, so that they stay where they are
    size_t count, capacity;
};

// Destroys all submissions, those taken too. After vkb_submissions_end, where some were submitted.
void vkb_submissions_destroy(const struct vkb_device *device, struct vkb_submissions *submissions);

// A submission that nobody uses, ready for vkb_commands_begin.
bool vkb_submissions_take(const struct vkb_device *device, struct vkb_submissions *submissions,
                          struct vkb_submission **submission, struct vkb_error *error);
// One that is pending can be taken again when it has finished.
void vkb_submissions_give_back(const struct vkb_device *device, struct vkb_submissions *submissions,
                               struct vkb_submission *submission);

// The number of the first submission pending; `now` where there is none.
uint64_t vkb_submissions_pending(const struct vkb_submissions *submissions, uint64_t now);

// Whether the device has run the submission, without a wait.
bool vkb_submission_over(const struct vkb_device *device, const struct vkb_submission *submission);

// Ends the recording and hands it to the device, with `semaphores` or NULL.
bool vkb_submission_submit(struct vkb_device *device, struct vkb_submission *submission,
                           const struct vkb_semaphores *semaphores, struct vkb_error *error);
// Waits until the device has run the submission, whatever is before it included. On failure it is
// still pending.
bool vkb_submission_wait(struct vkb_device *device, const struct vkb_submissions *submissions,
                         struct vkb_submission *submission, struct vkb_error *error);

// Waits for all that is pending: what submissions share can be changed by the host after this.
bool vkb_submissions_wait(struct vkb_device *device, struct vkb_submissions *submissions,
                          struct vkb_error *error);

// The same for the last time, also on a lost device: false where what submissions use cannot be
// destroyed, because the device may still be at work on it.
bool vkb_submissions_end(struct vkb_device *device, struct vkb_submissions *submissions,
                         struct vkb_error *error);

#endif
