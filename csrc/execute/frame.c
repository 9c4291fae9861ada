#include "execute/frame.h"

#include "execute/probe.h"
#include "execute/transient.h"
#include "share/exported_images.h"
#include "transfer/sources.h"
#include "vulkan/parts.h"

#include <string.h>

static const struct vkb_sink *const sinks[] = {&vkb_host_sink, &vkb_cuda_sink, &vkb_screen_sink};
enum { SINK_COUNT = sizeof sinks / sizeof sinks[0] };

bool vkb_frame_create(const struct vkb_device *device, const void *cache_data, size_t cache_size,
                      struct vkb_frame *frame, struct vkb_error *error)
{
    *frame = (struct vkb_frame){0};
    return vkb_pipelines_create(device, cache_data, cache_size, &frame->pipelines, error);
}

void vkb_frame_destroy(const struct vkb_device *device, struct vkb_frame *frame)
{
    while (frame->screens)
        vkb_screen_destroy(device, frame->screens, &frame->screens);
    vkb_submissions_destroy(device, &frame->submissions);
    vkb_buffer_destroy(device, &frame->constants);
    vkb_image_cache_destroy(device, &frame->cache);
    vkb_resources_destroy(device, &frame->resources);
    vkb_strided_copy_destroy(device, &frame->strided_copies);
    for (int kind = 0; kind < VKB_INPUT_COUNT; ++kind)
        vkb_upload_destroy(device, &frame->uploads[kind]);
    vkb_scene_destroy(device, &frame->scene);
    vkb_pipelines_destroy(device, &frame->pipelines);
    vkb_planner_destroy(&frame->planner);
    *frame = (struct vkb_frame){0};
}

// Reserves what the passes of the requests can need.
static bool reserve(struct vkb_run *run, const struct vkb_request *requests, uint32_t request_count,
                    struct vkb_error *error)
{
    const VkDeviceSize align = run->device->limits.minUniformBufferOffsetAlignment;
    const VkDeviceSize params = (sizeof(union vkb_params) + align - 1) / align * align;
    struct vkb_submission *submission = run->submission;
    uint32_t passes = 0;

    for (uint32_t i = 0; i < request_count; ++i)
        passes += requests[i].plan->graph.pass_count;
    return vkb_descriptors_reset(run->device, &submission->descriptors, error)
        && vkb_timer_reserve(run->device, passes + request_count, &submission->timer, error)
        && vkb_buffer_reserve(run->device, VKB_MEMORY_UPLOAD, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT,
                              params * passes, &submission->uniforms, error);
}

static bool load_scene(struct vkb_run *run, const struct vkb_scene_data *data,
                       struct vkb_error *error)
{
    struct vkb_device *device = run->device;
    struct vkb_submission *submission = run->submission;
    struct vkb_scene *scene = &run->frame->scene;

    if (scene->serial == data->serial)
        return true;
    if (!vkb_submissions_wait(device, &run->frame->submissions, error)
        || !vkb_scene_begin(device, &submission->commands, data, scene, error)
        || !vkb_submission_submit(device, submission, NULL, error)
        || !vkb_submission_wait(device, &run->frame->submissions, submission, error))
        return false;
    vkb_scene_end(device, data, scene);
    return true;
}

// Whether passes of the requests, or their outputs, read the image. An output on the host is made
// from what was given.
static bool is_read(const struct vkb_request *requests, uint32_t request_count, uint32_t index)
{
    for (uint32_t i = 0; i < request_count; ++i) {
        const struct vkb_plan *plan = requests[i].plan;
        const struct vkb_graph *graph = &plan->graph;
        for (uint32_t pass = 0; pass < graph->pass_count; ++pass)
            if (vkb_pass_reads(&graph->passes[pass], index))
                return true;
        for (uint32_t output = 0; output < plan->output_count; ++output)
            if (plan->outputs[output] == index
                && requests[i].outputs[output].sink != VKB_SINK_GIVEN)
                return true;
    }
    return false;
}

// Whether the host fills the image once, and it does not hold its pixels yet.
static bool is_missing(const struct vkb_run *run, uint32_t index)
{
    const struct vkb_image_row *row = &run->graph->images[index];
    const struct vkb_content *content = run->contents[index];

    // The content of a history may be what a call before has made.
    return row->serial && content && !run->inputs[row->input].image
        && !(content->valid && content->version == row->serial);
}

// The bytes of the image in the staging memory. Offsets of copies are multiples of a pixel.
static size_t staged_size(const struct vkb_run *run, uint32_t index)
{
    return run->images[index]->image.mapped
             ? 0
             : ((size_t)vkb_image_size(&run->graph->images[index]) + 15) & ~(size_t)15;
}

struct given {
    const struct vkb_image_row *row;
    unsigned char *to;
    size_t pitch;
};

static void copy_part(void *context, uint32_t part, uint32_t first, uint32_t end)
{
    const struct given *given = context;

    (void)part;
    for (; first < end; ++first)
        vkb_copy_given_row(given->row, first, vkb_formats[given->row->format].channels,
                           given->to + first * given->pitch);
}

// Writes the pixels to a mapped image, or to the staging memory.
static void copy_given(const struct vkb_run *run, uint32_t index, void *staged)
{
    const struct vkb_image_row *row = &run->graph->images[index];
    const struct vkb_image *image = &run->images[index]->image;
    struct given given = {
        .row = row,
        .to = staged ? staged : image->mapped,
        .pitch = staged ? (size_t)row->width * vkb_pixel_size(row->format) : image->row_pitch,
    };

    vkb_in_parts(run->device->workers, copy_part, NULL, &given, 0, row->height,
                 (size_t)vkb_image_size(row));
}

// Fills the images whose pixels the graph has: a kernel, a picture of dirt, weights.
static bool fill_constants(struct vkb_run *run, const struct vkb_request *requests,
                           uint32_t request_count, struct vkb_error *error)
{
    const struct vkb_graph *graph = run->graph;
    struct vkb_buffer *staging = &run->frame->constants;
    VkDeviceSize size = 0, start = 0;
    bool missing = false;

    for (uint32_t i = 0; i < graph->image_count; ++i) {
        if (graph->images[i].serial && is_read(requests, request_count, i)
            && !vkb_run_resolve(run, i, error))
            return false;
        if (is_missing(run, i)) {
            size += staged_size(run, i);
            missing = true;
        }
    }
    if (!missing)
        return true;
    if (!vkb_submissions_wait(run->device, &run->frame->submissions, error)
        || (size > 0
            && !vkb_buffer_reserve(run->device, VKB_MEMORY_UPLOAD, VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                                   size, staging, error)))
        return false;
    for (uint32_t i = 0; i < graph->image_count; ++i) {
        if (!is_missing(run, i))
            continue;
        const size_t staged = staged_size(run, i);
        copy_given(run, i, staged ? (char *)staging->mapped + start : NULL);
        if (staged)
            vkb_image_fill(run->device, run->submission->commands.buffer, &run->images[i]->image,
                           staging->handle, start);
        run->contents[i]->version = graph->images[i].serial;
        run->contents[i]->valid = true;
        start += staged;
    }
    return size == 0 || vkb_buffer_flush(run->device, staging, error);
}

// `next` is the following request; NULL: `request` is the last one.
static bool record_request(struct vkb_run *run, struct vkb_request *request,
                           const struct vkb_request *next, struct vkb_error *error)
{
    struct vkb_submission *submission = run->submission;
    struct vkb_frame *frame = run->frame;
    const struct vkb_graph *graph = &request->plan->graph;
    const struct vkb_plan_step step = {
        .plan = request->plan,
        .next = next ? &next->plan->graph : NULL,
        .contents = run->contents,
        .unfused = run->device->texels == VKB_TEXELS_OTHER,
        .source = vkb_sources_version(run),
        .scene = frame->scene.serial,
    };

    run->request = request;
    run->graph = graph;
    request->timing_count = 0;
    request->first_stamp = submission->timer.count;
    for (uint32_t i = 0; i < graph->image_count; ++i) {
        const struct vkb_image_row row = vkb_run_row(run, i);
        struct vkb_cached_image *given = run->inputs[row.input].image;
        vkb_run_set_image(run, i, given ? given : vkb_image_cache_find(&frame->cache, &row));
    }
    if (!vkb_planner_mark(&frame->planner, &step, error))
        return false;
    if (run->shares && !vkb_begin_sharing(run, error))
        return false;
    for (uint32_t i = 0; !run->shares && i < graph->image_count; ++i)
        if (frame->planner.wanted[i] && !vkb_run_resolve(run, i, error))
            return false;
#ifndef VKBLOOM_FAULTS
    // (Faults are counted in one thread.)
    if (graph != frame->compiled) {
        vkb_record_pipelines(run);
        frame->compiled = graph;
    }
#endif
    if (!vkb_planner_run(&frame->planner, &step, &frame->cache.clock, vkb_record_group, run, error))
        return false;
    for (size_t i = 0; i < SINK_COUNT; ++i)
        if (sinks[i]->record && !sinks[i]->record(run, error))
            return false;
    return true;
}

static bool record_and_submit(struct vkb_run *run, const struct vkb_frame_source *source,
                              struct vkb_request *requests, uint32_t request_count,
                              struct vkb_error *error)
{
    struct vkb_device *device = run->device;
    struct vkb_submission *submission = run->submission;
    VkCommandBuffer commands = submission->commands.buffer;

    for (size_t i = 0; i < SINK_COUNT; ++i)
        if (sinks[i]->prepare && !sinks[i]->prepare(run, requests, request_count, error))
            return false;
    if (run->show && !run->show->acquired)
        return true;
    if (!vkb_exported_fill(run, source, error)
        || !vkb_commands_begin(device, &submission->commands, error))
        return false;
    vkb_timer_reset(device, commands, &submission->timer);
    if (!vkb_sources_record(run, error) || !fill_constants(run, requests, request_count, error))
        return false;
    for (uint32_t i = 0; i < request_count; ++i)
        if (!record_request(run, &requests[i], i + 1 < request_count ? &requests[i + 1] : NULL,
                            error))
            return false;
    // After all copies and stores to buffers.
    vkb_barrier_record(device, commands, NULL, true, VKB_ACCESS_RESOURCE, VKB_ACCESS_HOST_READ);
    return vkb_buffer_flush(device, &submission->uniforms, error)
        && vkb_submission_submit(device, submission, &run->sync, error);
}

// No image is replaced within a submission, so that each is for all requests.
static void find_usages(struct vkb_run *run, const struct vkb_frame_source *source,
                        const struct vkb_request *requests, uint32_t request_count)
{
    for (uint32_t i = 0; i < request_count; ++i) {
        const struct vkb_plan *plan = requests[i].plan;
        for (uint32_t image = 0; image < plan->graph.image_count; ++image) {
            const struct vkb_image_row *row = &plan->graph.images[image];
            const struct vkb_input *input = source->inputs[row->input];
            run->usages[image] |= row->usage;
            // The host writes what it has given to linear texels itself.
            if ((row->input || row->serial) && !run->device->linear_texels)
                run->usages[image] |= vkb_access_usage(VKB_ACCESS_COPY_TARGET);
            if (input && input->exported)
                run->usages[image] |= vkb_access_usage(VKB_ACCESS_DISPATCH_STORED);
        }
        for (uint32_t output = 0; output < plan->output_count; ++output)
            if (requests[i].outputs[output].exported)
                run->usages[plan->outputs[output]] |=
                    vkb_exported_usage(plan->graph.images[plan->outputs[output]].format);
    }
}

static bool submit(struct vkb_run *run, const struct vkb_frame_source *source,
                   struct vkb_request *requests, uint32_t request_count, struct vkb_error *error)
{
    run->graph = &requests[0].plan->graph;
    run->shares = vkb_shares_memory(run->device, requests[0].plan, request_count);
    find_usages(run, source, requests, request_count);
    if (run->shares)
        vkb_share_usages(run);
    return (!source->scene || load_scene(run, source->scene, error))
        && vkb_sources_stage(run, source, requests, request_count, error)
        && reserve(run, requests, request_count, error)
        && vkb_probe_texels(run, requests, request_count, error)
        && record_and_submit(run, source, requests, request_count, error);
}

// The images that the submission has written become those of the next call. So one that fails
// changes no history.
static void keep_histories(struct vkb_run *run)
{
    const struct vkb_graph *graph = run->graph;

    for (uint32_t i = 0; i < graph->image_count; ++i) {
        const struct vkb_image_row *row = &graph->images[i];
        struct vkb_resident *resident =
            vkb_is_history(row) ? run->request->kept[row->input - VKB_INPUT_HISTORY] : NULL;
        if (resident)
            vkb_resident_take(resident, run->images[row->history_of]);
    }
}

// After a failure it is unknown what the device did, so images and commands are created again. (The
// state of resources stays: a submission that failed has not changed it.) The images are created
// later, when no submission is pending, since a wait here could not be interrupted.
static void fail_frame(struct vkb_device *device, struct vkb_frame *frame,
                       struct vkb_submission *submission, const struct vkb_error *error)
{
    frame->stale = true;
    vkb_device_remember_loss(device, error);
    if (!submission->pending)
        vkb_commands_destroy(device, &submission->commands);
}

static bool renew(struct vkb_device *device, struct vkb_frame *frame, struct vkb_error *error)
{
    if (!frame->stale)
        return true;
    if (!vkb_submissions_wait(device, &frame->submissions, error))
        return false;
    vkb_image_cache_destroy(device, &frame->cache);
    frame->stale = false;
    return true;
}

// Begins a submission: destroys cached objects that are old and that no pending submission uses.
static void trim(const struct vkb_device *device, struct vkb_frame *frame,
                 struct vkb_submission *submission)
{
    submission->number = ++frame->submitted;
    const struct vkb_age age = {
        .now = submission->number,
        .pending = vkb_submissions_pending(&frame->submissions, submission->number),
    };

    vkb_pipelines_trim(device, &frame->pipelines, &age);
    vkb_image_cache_trim(device, &frame->cache, &age);
    vkb_resources_trim(device, &frame->resources, &age);
}

struct vkb_cached vkb_frame_cached(const struct vkb_frame *frame)
{
    return (struct vkb_cached){
        .pipelines = frame->pipelines.entry_count,
        .image_bytes = vkb_image_cache_size(&frame->cache),
        .allocations = frame->cache.spares.missed,
    };
}

bool vkb_frame_submit(struct vkb_device *device, struct vkb_frame *frame,
                      const struct vkb_frame_source *source, struct vkb_request *requests,
                      uint32_t request_count, struct vkb_show *show,
                      struct vkb_submission **submission, struct vkb_error *error)
{
    struct vkb_run run = {.device = device, .frame = frame, .show = show};
    // All requests have the same images.
    const uint32_t image_count = requests[0].plan->graph.image_count;
    bool done;

    if (!renew(device, frame, error)
        || !vkb_submissions_take(device, &frame->submissions, &run.submission, error))
        return false;
    trim(device, frame, run.submission);
    done = (run.images = vkb_alloc(error, image_count, sizeof *run.images))
        && (run.contents = vkb_alloc(error, image_count, sizeof *run.contents))
        && (run.usages = vkb_alloc(error, image_count, sizeof *run.usages))
        && submit(&run, source, requests, request_count, error);
    if (done && (!show || show->acquired))
        keep_histories(&run);
    vkb_free(run.images);
    vkb_free(run.contents);
    vkb_free(run.usages);
    if (done && (!show || show->acquired)) {
        run.submission->requests = requests;
        run.submission->request_count = request_count;
        for (uint32_t i = 0; i < request_count; ++i)
            requests[i].non_finite = frame->non_finite;
        *submission = run.submission;
        vkb_sources_end(&run, true);
        for (size_t i = 0; i < SINK_COUNT; ++i)
            done = (!sinks[i]->finish || sinks[i]->finish(&run, requests, request_count, error))
                && done;
        return done;
    }
    if (!done) {
        vkb_sources_end(&run, false);
        fail_frame(device, frame, run.submission, error);
        vkb_resources_drop(device, &frame->resources, run.submission->number);
    }
    vkb_submissions_give_back(device, &frame->submissions, run.submission);
    return done;
}

// Reads timings and outputs of a submission that the device has finished.
static void fetch(const struct vkb_device *device, const struct vkb_submission *submission)
{
    for (uint32_t i = 0; i < submission->request_count; ++i) {
        struct vkb_request *request = &submission->requests[i];
        if (submission->readback.counted) {
            const uint32_t *counts = submission->readback.counts.mapped;
            vkb_add_non_finite(&request->non_finite, (struct vkb_non_finite){counts[0], counts[1]});
            for (uint32_t layer = 0; layer < request->plan->graph.layers; ++layer) {
                const uint32_t *own = counts + layer * (VKB_COUNTS_SIZE / sizeof *counts);
                request->layer_non_finite[layer] = (struct vkb_non_finite){own[0], own[1]};
            }
        }
        for (uint32_t timing = 0; timing < request->timing_count; ++timing)
            request->timings[timing].seconds =
                vkb_timer_seconds(device, &submission->timer, request->first_stamp + timing);
        for (uint32_t output = 0; output < request->plan->output_count; ++output)
            vkb_readback_fetch(device, &submission->readback, &request->outputs[output]);
    }
}

bool vkb_frame_collect(struct vkb_device *device, struct vkb_frame *frame,
                       struct vkb_submission *submission, bool *over, struct vkb_error *error)
{
    *over = vkb_submission_wait(device, &frame->submissions, submission, error);
    const bool done = *over && vkb_readback_end(device, &submission->readback, error)
                   && vkb_timer_fetch(device, &submission->timer, error);

    if (done) {
        fetch(device, submission);
        vkb_exported_take_counts(device, frame, submission);
    } else if (error->kind != VKB_ERROR_INTERRUPTED)
        fail_frame(device, frame, submission, error);
    if (*over)
        vkb_submissions_give_back(device, &frame->submissions, submission);
    return done;
}

bool vkb_frame_drop(struct vkb_device *device, struct vkb_frame *frame,
                    struct vkb_submission *submission)
{
    // A wait is interruptible and takes the GIL, which the caller holds.
    if (!vkb_submission_over(device, submission))
        return false;
    vkb_submissions_give_back(device, &frame->submissions, submission);
    return true;
}

bool vkb_frame_end(struct vkb_device *device, struct vkb_frame *frame, struct vkb_error *error)
{
    if (!vkb_submissions_end(device, &frame->submissions, error))
        return false;
    if (!frame->screens)
        return !device->lost || vkb_device_end_idle(device, error);
    // The first wait may fail for lack of memory, too. A lost device has ended everything.
    return vkb_device_wait_idle(device, error)
        || (error->kind != VKB_ERROR_INTERRUPTED && error->result != VK_TIMEOUT
            && (vkb_device_wait_idle(device, error) || error->result == VK_ERROR_DEVICE_LOST));
}
