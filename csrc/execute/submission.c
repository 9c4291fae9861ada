#include "execute/submission.h"

enum { KEPT_SUBMISSIONS = 3 };  // unused ones; several threads at once may have needed more

static void release_inputs(const struct vkb_device *device, struct vkb_submission *submission)
{
    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind)
        if (submission->inputs[kind].buffer)
            vkb_image_destroy(device, &submission->inputs[kind]);
}

static void destroy_submission(const struct vkb_device *device, struct vkb_submission *submission)
{
    vkb_timer_destroy(device, &submission->timer);
    vkb_descriptors_destroy(device, &submission->descriptors);
    vkb_buffer_destroy(device, &submission->uniforms);
    vkb_readback_destroy(device, &submission->readback);
    release_inputs(device, submission);
    vkb_commands_destroy(device, &submission->commands);
    vkb_free(submission);
}

void vkb_submissions_destroy(const struct vkb_device *device, struct vkb_submissions *submissions)
{
    for (size_t i = 0; i < submissions->count; ++i)
        destroy_submission(device, submissions->submissions[i]);
    vkb_free(submissions->submissions);
    *submissions = (struct vkb_submissions){0};
}

// Also notices which abandoned submissions the device has finished: copies of rows.
static struct vkb_submission *find_free(const struct vkb_device *device,
                                        const struct vkb_submissions *submissions)
{
    struct vkb_submission *free = NULL;

    for (size_t i = 0; i < submissions->count; ++i) {
        struct vkb_submission *submission = submissions->submissions[i];
        if (!submission->taken && vkb_submission_over(device, submission))
            free = submission;
    }
    return free;
}

bool vkb_submissions_take(const struct vkb_device *device, struct vkb_submissions *submissions,
                          struct vkb_submission **taken, struct vkb_error *error)
{
    struct vkb_submission *submission = find_free(device, submissions);

    if (!submission
        && !(submission = vkb_append(error, &submissions->submissions, &submissions->count,
                                     &submissions->capacity, sizeof *submission)))
        return false;
    if (!submission->commands.pool && !vkb_commands_create(device, &submission->commands, error))
        return false;
    submission->taken = true;
    submission->uniform_used = 0;
    *taken = submission;
    return true;
}

void vkb_submissions_give_back(const struct vkb_device *device, struct vkb_submissions *submissions,
                               struct vkb_submission *submission)
{
    size_t free_count = 0;

    submission->taken = false;
    submission->requests = NULL;
    if (submission->pending)
        return;
    submission->request_count = 0;
    vkb_readback_release(device, &submission->readback);
    release_inputs(device, submission);
    for (size_t i = 0; i < submissions->count; ++i)
        free_count += !submissions->submissions[i]->taken && !submissions->submissions[i]->pending;
    if (free_count <= KEPT_SUBMISSIONS)
        return;
    for (size_t i = 0; i < submissions->count; ++i)
        if (submissions->submissions[i] == submission) {
            --submissions->count;
            submissions->submissions[i] = submissions->submissions[submissions->count];
        }
    destroy_submission(device, submission);
}

bool vkb_submission_submit(struct vkb_device *device, struct vkb_submission *submission,
                           const struct vkb_sync *order, struct vkb_error *error)
{
    submission->pending = VK(error, device->vk.vkEndCommandBuffer(submission->commands.buffer))
                       && vkb_device_submit(device, submission->commands.buffer, order,
                                            submission->commands.fence, error);
    return submission->pending;
}

uint64_t vkb_submissions_pending(const struct vkb_submissions *submissions, uint64_t now)
{
    uint64_t first = now;

    for (size_t i = 0; i < submissions->count; ++i)
        if (submissions->submissions[i]->pending && submissions->submissions[i]->number < first)
            first = submissions->submissions[i]->number;
    return first;
}

bool vkb_submission_over(const struct vkb_device *device, struct vkb_submission *submission)
{
    const VkFence *fence = &submission->commands.fence;
    struct vkb_error ignored;

    submission->pending = submission->pending
                       && (device->vk.vkGetFenceStatus(device->handle, *fence) != VK_SUCCESS
                           || !VK(&ignored, device->vk.vkResetFences(device->handle, 1, fence)));
    return !submission->pending;
}

// All pending submissions may run before this one. A submission without requests loads a scene, and
// counts as a frame.
static uint32_t count_frames(const struct vkb_submissions *submissions)
{
    uint32_t count = 0;

    for (size_t i = 0; i < submissions->count; ++i)
        if (submissions->submissions[i]->pending)
            count += submissions->submissions[i]->request_count
                       ? submissions->submissions[i]->request_count
                       : 1;
    return count;
}

bool vkb_submission_wait(struct vkb_device *device, const struct vkb_submissions *submissions,
                         struct vkb_submission *submission, struct vkb_error *error)
{
    if (submission->pending
        && !vkb_device_wait(device, submission->commands.fence, count_frames(submissions), error))
        return false;
    submission->pending = false;
    return true;
}

bool vkb_submissions_wait(struct vkb_device *device, struct vkb_submissions *submissions,
                          struct vkb_error *error)
{
    for (size_t i = 0; i < submissions->count; ++i)
        if (!vkb_submission_wait(device, submissions, submissions->submissions[i], error))
            return false;
    return true;
}

bool vkb_submissions_end(struct vkb_device *device, struct vkb_submissions *submissions,
                         struct vkb_error *error)
{
    for (size_t i = 0; i < submissions->count; ++i) {
        struct vkb_submission *submission = submissions->submissions[i];
        if (vkb_submission_wait(device, submissions, submission, error))
            continue;
        if (error->kind == VKB_ERROR_INTERRUPTED || error->result == VK_TIMEOUT)
            return false;
        // The first wait may have failed for lack of memory, so wait again. If the device is lost,
        // its objects can be destroyed.
        if (!vkb_submission_wait(device, submissions, submission, error)
            && error->result != VK_ERROR_DEVICE_LOST)
            return false;
    }
    return true;
}
