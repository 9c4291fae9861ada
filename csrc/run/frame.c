#include "run/frame.h"

#include "run/record.h"

#include <string.h>

bool vkb_frame_create(const struct vkb_device *device, const void *cache_data, size_t cache_size,
                      struct vkb_frame *frame, struct vkb_error *error)
{
    *frame = (struct vkb_frame){0};
    return vkb_pipelines_create(device, cache_data, cache_size, &frame->pipelines, error);
}

void vkb_frame_destroy(const struct vkb_device *device, struct vkb_frame *frame)
{
    vkb_flights_destroy(device, &frame->flights);
    vkb_slots_destroy(device, &frame->slots);
    vkb_upload_destroy(device, &frame->upload);
    vkb_scene_destroy(device, &frame->scene);
    vkb_pipelines_destroy(device, &frame->pipelines);
    vkb_planner_destroy(&frame->planner);
    *frame = (struct vkb_frame){0};
}

static bool reserve_descriptors(struct vkb_run *run, uint32_t sets, struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &run->device->vk;
    struct vkb_flight *flight = run->flight;

    if (sets <= flight->descriptor_capacity)
        return VK(error, vk->vkResetDescriptorPool(run->device->handle, flight->descriptors, 0));
    vk->vkDestroyDescriptorPool(run->device->handle, flight->descriptors, NULL);
    flight->descriptors = VK_NULL_HANDLE;
    flight->descriptor_capacity = 0;
    if (!VK(error,
            vk->vkCreateDescriptorPool(
                run->device->handle,
                &(VkDescriptorPoolCreateInfo){
                    .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
                    .maxSets = sets,
                    .poolSizeCount = 3,
                    .pPoolSizes =
                        (VkDescriptorPoolSize[]){
                            {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, sets},
                            {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, sets * VKB_MAX_READS},
                            {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, sets * (VKB_MAX_READS + 1)},
                        },
                },
                NULL, &flight->descriptors)))
        return false;
    flight->descriptor_capacity = sets;
    return true;
}

// Room for all that the requests can need.
static bool reserve(struct vkb_run *run, struct vkb_request *requests, uint32_t request_count,
                    struct vkb_error *error)
{
    const VkDeviceSize align = run->device->limits.minUniformBufferOffsetAlignment;
    const VkDeviceSize params = (sizeof(union vkb_params) + align - 1) / align * align;
    const struct vkb_scene *scene = &run->frame->scene;
    const uint32_t surfaces = scene->body.surface_count + scene->glow.surface_count;
    struct vkb_flight *flight = run->flight;
    uint32_t passes = 0;

    for (uint32_t i = 0; i < request_count; ++i) {
        const struct vkb_plan *plan = requests[i].plan;
        passes += plan->graph.pass_count;
        for (uint32_t output = 0; output < plan->output_count; ++output) {
            const struct vkb_image_row *row = &plan->graph.images[plan->outputs[output]];
            if (!vkb_readback_plan(run->device, &flight->readback, row->format, row->width,
                                   row->height, &requests[i].outputs[output], error))
                return false;
        }
    }
    return reserve_descriptors(run, passes + request_count * surfaces, error)
        && vkb_timer_reserve(run->device, passes, &flight->timer, error)
        && vkb_buffer_reserve(run->device, VKB_MEMORY_UPLOAD, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT,
                              params * passes, &flight->uniforms, error)
        && vkb_readback_reserve(run->device, &flight->readback, error);
}

static void set_slot(struct vkb_run *run, uint32_t image, struct vkb_slot *slot)
{
    run->slots[image] = slot;
    run->contents[image] = slot ? &slot->content : NULL;
}

// The slot of the graph's image. One that other commands may still use is replaced only when those
// have run; the requests of this flight have the same images.
static bool resolve(struct vkb_run *run, uint32_t image, struct vkb_error *error)
{
    const struct vkb_image_row *row = &run->graph->images[image];
    struct vkb_slots *slots = &run->frame->slots;
    struct vkb_slot *slot;

    if ((vkb_slots_replaces(slots, row)
         && !vkb_flights_land(run->device, &run->frame->flights, error))
        || !vkb_slots_resolve(run->device, slots, row, &slot, error))
        return false;
    set_slot(run, image, slot);
    return true;
}

static bool load_scene(struct vkb_run *run, const struct vkb_scene_data *data,
                       struct vkb_error *error)
{
    struct vkb_device *device = run->device;
    struct vkb_flight *flight = run->flight;
    struct vkb_scene *scene = &run->frame->scene;

    if (scene->serial == data->serial)
        return true;
    if (!vkb_flights_land(device, &run->frame->flights, error)
        || !vkb_scene_begin(device, &flight->commands, data, scene, error)
        || !vkb_flight_submit(device, flight, error)
        || !vkb_flight_wait(device, &run->frame->flights, flight, error))
        return false;
    vkb_scene_end(device, data, scene);
    return true;
}

// Stages the image and finds out whether the device has it already.
static bool stage_input(struct vkb_run *run, const struct vkb_input *input, struct vkb_error *error)
{
    bool changed;

    for (uint32_t i = 0; i < run->graph->image_count; ++i)
        if (run->graph->images[i].input) {
            if (!resolve(run, i, error))
                return false;
            run->input = run->slots[i];
        }
    // An image that its last writing did not reach holds nothing to compare with.
    if (run->input->image.mapped && !run->input->content.valid)
        vkb_upload_forget(&run->frame->upload);
    if (!vkb_upload_stage(run->device, &run->frame->upload, &run->frame->flights, input,
                          &run->input->image, &changed, error))
        return false;
    run->send_input = changed || !run->input->content.valid;
    return !run->send_input
        || vkb_content_begin_writing(&run->input->content, &run->frame->slots.clock, NULL, 0,
                                     error);
}

static void record_input(struct vkb_run *run)
{
    if (!run->input->image.mapped)
        vkb_upload_record(run->device, run->flight->commands.buffer, &run->frame->upload,
                          &run->input->image);
    run->input->content.valid = true;
}

static uint64_t source_version(const struct vkb_run *run)
{
    return run->input ? run->input->content.version : run->frame->scene.serial;
}

// `next` is the request after it, NULL after the last.
static bool record_request(struct vkb_run *run, struct vkb_request *request,
                           const struct vkb_request *next, struct vkb_error *error)
{
    struct vkb_flight *flight = run->flight;
    struct vkb_frame *frame = run->frame;
    const struct vkb_graph *graph = &request->plan->graph;
    const struct vkb_plan_step step = {
        .plan = request->plan,
        .next = next ? &next->plan->graph : NULL,
        .contents = run->contents,
        .source = source_version(run),
        .scene = frame->scene.serial,
    };

    run->request = request;
    run->graph = graph;
    request->timing_count = 0;
    request->first_span = flight->timer.span_count;
    for (uint32_t i = 0; i < graph->image_count; ++i)
        set_slot(run, i, vkb_slots_find(&frame->slots, &graph->images[i]));
    if (!vkb_planner_mark(&frame->planner, &step, error))
        return false;
    for (uint32_t i = 0; i < graph->image_count; ++i)
        if (frame->planner.wanted[i] && !resolve(run, i, error))
            return false;
    if (!vkb_planner_run(&frame->planner, &step, &frame->slots.clock, vkb_record_group, run, error))
        return false;
    for (uint32_t i = 0; i < request->plan->output_count; ++i)
        vkb_readback_record(run->device, flight->commands.buffer, &flight->readback,
                            &run->slots[request->plan->outputs[i]]->image, &request->outputs[i]);
    return true;
}

static bool record_and_submit(struct vkb_run *run, struct vkb_request *requests,
                              uint32_t request_count, struct vkb_error *error)
{
    struct vkb_device *device = run->device;
    struct vkb_flight *flight = run->flight;
    VkCommandBuffer commands = flight->commands.buffer;

    if (!vkb_commands_begin(device, &flight->commands, error))
        return false;
    vkb_timer_reset(device, commands, &flight->timer);
    if (run->send_input)
        record_input(run);
    for (uint32_t i = 0; i < request_count; ++i)
        if (!record_request(run, &requests[i], i + 1 < request_count ? &requests[i + 1] : NULL,
                            error))
            return false;
    vkb_barrier_record_host_read(device, commands);
    return vkb_buffer_flush(device, &flight->uniforms, error)
        && vkb_flight_submit(device, flight, error);
}

static bool submit(struct vkb_run *run, const struct vkb_frame_source *source,
                   struct vkb_request *requests, uint32_t request_count, struct vkb_error *error)
{
    run->graph = &requests[0].plan->graph;
    return (!source->scene || load_scene(run, source->scene, error))
        && (!source->input || stage_input(run, source->input, error))
        && reserve(run, requests, request_count, error)
        && record_and_submit(run, requests, request_count, error);
}

// After a failure nothing is known of what the device did: images and commands are made anew. The
// images later, when nothing is in the air: a wait here could not be interrupted.
static void fail_frame(struct vkb_device *device, struct vkb_frame *frame,
                       struct vkb_flight *flight, const struct vkb_error *error)
{
    frame->stale = true;
    device->lost = device->lost || error->kind == VKB_ERROR_DEVICE_LOST;
    if (!flight->airborne)
        vkb_commands_destroy(device, &flight->commands);
}

static bool renew(struct vkb_device *device, struct vkb_frame *frame, struct vkb_error *error)
{
    if (!frame->stale)
        return true;
    if (!vkb_flights_land(device, &frame->flights, error))
        return false;
    vkb_slots_destroy(device, &frame->slots);
    frame->stale = false;
    return true;
}

// Begins a submission: what no submission has used for long, and none may still use, goes.
static void trim(const struct vkb_device *device, struct vkb_frame *frame,
                 struct vkb_flight *flight)
{
    flight->number = ++frame->submissions;
    const struct vkb_age age = {
        .now = flight->number,
        .pending = vkb_flights_pending(&frame->flights, flight->number),
    };

    vkb_pipelines_trim(device, &frame->pipelines, &age);
    vkb_slots_trim(device, &frame->slots, &age);
}

struct vkb_cached vkb_frame_cached(const struct vkb_frame *frame)
{
    return (struct vkb_cached){
        .pipelines = frame->pipelines.entry_count,
        .framebuffers = frame->slots.framebuffer_count,
        .image_bytes = vkb_slots_size(&frame->slots),
    };
}

bool vkb_frame_submit(struct vkb_device *device, struct vkb_frame *frame,
                      const struct vkb_frame_source *source, struct vkb_request *requests,
                      uint32_t request_count, struct vkb_flight **flight, struct vkb_error *error)
{
    struct vkb_run run = {.device = device, .frame = frame};
    // All requests have the same images.
    const uint32_t image_count = requests[0].plan->graph.image_count;
    bool done;

    if (!renew(device, frame, error)
        || !vkb_flights_take(device, &frame->flights, &run.flight, error))
        return false;
    trim(device, frame, run.flight);
    done = (run.slots = vkb_alloc(error, image_count, sizeof *run.slots))
        && (run.contents = vkb_alloc(error, image_count, sizeof *run.contents))
        && submit(&run, source, requests, request_count, error);
    vkb_free(run.slots);
    vkb_free(run.contents);
    if (done) {
        run.flight->requests = requests;
        run.flight->request_count = request_count;
        *flight = run.flight;
    } else {
        fail_frame(device, frame, run.flight, error);
        vkb_flights_give_back(device, &frame->flights, run.flight);
    }
    return done;
}

// Times of the same name are of steps of one thing: they become one.
static void merge_timings(struct vkb_request *request)
{
    uint32_t count = 0;

    for (uint32_t i = 0; i < request->timing_count; ++i) {
        uint32_t at = 0;
        while (at < count && strcmp(request->timings[at].name, request->timings[i].name) != 0)
            ++at;
        if (at < count)
            request->timings[at].seconds += request->timings[i].seconds;
        else
            request->timings[count++] = request->timings[i];
    }
    request->timing_count = count;
}

// What the device has left for the requests of a flight that is over.
static void fetch(const struct vkb_device *device, const struct vkb_flight *flight)
{
    for (uint32_t i = 0; i < flight->request_count; ++i) {
        struct vkb_request *request = &flight->requests[i];
        for (uint32_t timing = 0; timing < request->timing_count; ++timing)
            request->timings[timing].seconds =
                vkb_timer_seconds(device, &flight->timer, request->first_span + timing);
        merge_timings(request);
        for (uint32_t output = 0; output < request->plan->output_count; ++output)
            vkb_readback_fetch(&flight->readback, &request->outputs[output]);
    }
}

bool vkb_frame_collect(struct vkb_device *device, struct vkb_frame *frame,
                       struct vkb_flight *flight, bool *over, struct vkb_error *error)
{
    *over = vkb_flight_wait(device, &frame->flights, flight, error);
    const bool done = *over && vkb_readback_end(device, &flight->readback, error)
                   && vkb_timer_fetch(device, &flight->timer, error);

    if (done)
        fetch(device, flight);
    else if (error->kind != VKB_ERROR_INTERRUPTED)
        fail_frame(device, frame, flight, error);
    if (*over)
        vkb_flights_give_back(device, &frame->flights, flight);
    return done;
}

bool vkb_frame_drop(struct vkb_device *device, struct vkb_frame *frame, struct vkb_flight *flight)
{
    struct vkb_error error;

    if (!vkb_flight_over(device, flight)
        || !vkb_flight_wait(device, &frame->flights, flight, &error))
        return false;
    vkb_flights_give_back(device, &frame->flights, flight);
    return true;
}

bool vkb_frame_end(struct vkb_device *device, struct vkb_frame *frame, struct vkb_error *error)
{
    return vkb_flights_end(device, &frame->flights, error);
}
