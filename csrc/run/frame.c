#include "run/frame.h"

#include "graph/plan.h"
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
    vkb_graph_destroy(&frame->previous.graph);
    *frame = (struct vkb_frame){0};
}

static bool append(struct vkb_run *run, const void *bytes, size_t size, struct vkb_error *error)
{
    if (!vkb_grow(error, &run->recipe, &run->recipe_capacity, run->recipe_size + size, 1))
        return false;
    memcpy(run->recipe + run->recipe_size, bytes, size);
    run->recipe_size += size;
    return true;
}

// What passes first..end-1 make their targets from: their rows, with the versions of what they read
// in place of the graph's indices.
static bool write_recipe(struct vkb_run *run, uint32_t first, uint32_t end, struct vkb_error *error)
{
    run->recipe_size = 0;
    for (uint32_t i = first; i < end; ++i) {
        struct vkb_pass_row row = run->graph->passes[i];
        unsigned char bytes[sizeof row];
        uint64_t versions[VKB_MAX_READS + 1] = {0};

        for (uint32_t read = 0; read < row.read_count; ++read)
            versions[read] = run->slots[row.reads[read]]->version;
        if (row.geometry != VKB_GEOMETRY_FULLSCREEN && row.geometry != VKB_GEOMETRY_DISPATCH)
            versions[VKB_MAX_READS] = run->frame->scene.serial;
        memset(row.reads, 0, sizeof row.reads);
        memset(row.targets, 0, sizeof row.targets);
        row.depth = row.depth != VKB_NO_IMAGE;
        if (!append(run, bytes, vkb_pass_pack(&row, bytes), error)
            || !append(run, versions, sizeof versions, error))
            return false;
    }
    return true;
}

// Whether the image is there and holds what a pass before `end` would make.
static bool is_current(const struct vkb_run *run, uint32_t image, uint32_t end)
{
    bool current = run->graph->images[image].input;

    for (uint32_t i = 0; i < end; ++i)
        current = current || (run->current[i] && vkb_pass_writes(&run->graph->passes[i], image));
    return current && run->slots[image];
}

// The slots of a pass's targets, the depth last; returns how many.
static uint32_t target_slots(const struct vkb_run *run, const struct vkb_pass_row *pass,
                             struct vkb_slot **slots)
{
    uint32_t count = 0;

    for (uint32_t i = 0; i < pass->target_count; ++i)
        slots[count++] = run->slots[pass->targets[i]];
    if (pass->depth != VKB_NO_IMAGE)
        slots[count++] = run->slots[pass->depth];
    return count;
}

// Finds out which passes have nothing to do, from the first to the last: their targets hold what
// the recipe says, and all that they read is so too.
static bool mark_current(struct vkb_run *run, struct vkb_error *error)
{
    const struct vkb_graph *graph = run->graph;

    for (uint32_t i = 0; i < graph->image_count; ++i)
        run->slots[i] = vkb_slots_find(&run->frame->slots, &graph->images[i]);
    memset(run->current, 0, graph->pass_count * sizeof *run->current);
    for (uint32_t first = 0, end; first < graph->pass_count; first = end) {
        struct vkb_slot *targets[VKB_MAX_TARGETS + 1] = {0};
        const uint32_t target_count = target_slots(run, &graph->passes[first], targets);
        bool found = true;

        end = vkb_graph_group_end(graph, first);
        for (uint32_t i = first; i < end; ++i)
            for (uint32_t read = 0; read < graph->passes[i].read_count; ++read)
                found = found && is_current(run, graph->passes[i].reads[read], first);
        for (uint32_t i = 0; i < target_count; ++i)
            found = found && targets[i];
        if (found && !write_recipe(run, first, end, error))
            return false;
        for (uint32_t i = 0; i < target_count; ++i)
            found = found && vkb_slot_up_to_date(targets[i], run->recipe, run->recipe_size);
        for (uint32_t i = first; i < end; ++i)
            run->current[i] = found;
    }
    return true;
}

static bool record_passes(struct vkb_run *run, struct vkb_error *error)
{
    const struct vkb_graph *graph = run->graph;

    for (uint32_t first = 0, end; first < graph->pass_count; first = end) {
        struct vkb_slot *targets[VKB_MAX_TARGETS + 1] = {0};
        uint32_t target_count;
        bool current = true;

        end = vkb_graph_group_end(graph, first);
        // All passes of a group are needed if one is: they share their targets.
        if (!run->needed[first])
            continue;
        if (!write_recipe(run, first, end, error))
            return false;
        target_count = target_slots(run, &graph->passes[first], targets);
        for (uint32_t i = 0; i < target_count; ++i)
            current = current && vkb_slot_up_to_date(targets[i], run->recipe, run->recipe_size);
        if (!current && !vkb_record_group(run, first, end, targets, target_count, error))
            return false;
    }
    return true;
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

// Room for all that the points can need.
static bool reserve(struct vkb_run *run, struct vkb_point *points, uint32_t point_count,
                    struct vkb_error *error)
{
    const VkDeviceSize align = run->device->limits.minUniformBufferOffsetAlignment;
    const VkDeviceSize params = (sizeof(union vkb_params) + align - 1) / align * align;
    const struct vkb_scene *scene = &run->frame->scene;
    const uint32_t surfaces = scene->body.surface_count + scene->glow.surface_count;
    struct vkb_flight *flight = run->flight;
    uint32_t passes = 0;

    for (uint32_t i = 0; i < point_count; ++i) {
        struct vkb_point *point = &points[i];
        passes += point->graph.pass_count;
        for (uint32_t output = 0; output < point->output_count; ++output) {
            const struct vkb_image_row *row = &point->graph.images[point->outputs[output].image];
            if (!vkb_readback_plan(run->device, &flight->readback, row->format, row->width,
                                   row->height, &point->outputs[output], error))
                return false;
        }
    }
    return reserve_descriptors(run, passes + point_count * surfaces, error)
        && vkb_timer_reserve(run->device, passes, &flight->timer, error)
        && vkb_buffer_reserve(run->device, VKB_MEMORY_UPLOAD, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT,
                              params * passes, &flight->uniforms, error)
        && vkb_readback_reserve(run->device, &flight->readback, error);
}

// The slot of the graph's image. One that other commands may still use is replaced only when those
// have run; the points of this flight have the same images.
static bool resolve(struct vkb_run *run, uint32_t image, struct vkb_error *error)
{
    const struct vkb_image_row *row = &run->graph->images[image];
    struct vkb_slots *slots = &run->frame->slots;

    return (!vkb_slots_replaces(slots, row)
            || vkb_flights_land(run->device, &run->frame->flights, error))
        && vkb_slots_resolve(run->device, slots, row, &run->slots[image], error);
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
    if (run->input->image.mapped && !run->input->valid)
        vkb_upload_forget(&run->frame->upload);
    if (!vkb_upload_stage(run->device, &run->frame->upload, &run->frame->flights, input,
                          &run->input->image, &changed, error))
        return false;
    run->send_input = changed || !run->input->valid;
    return !run->send_input
        || vkb_slot_begin_writing(&run->frame->slots, run->input, NULL, 0, error);
}

static void record_input(struct vkb_run *run)
{
    if (!run->input->image.mapped)
        vkb_upload_record(run->device, run->flight->commands.buffer, &run->frame->upload,
                          &run->input->image);
    run->input->valid = true;
}

static uint64_t source_version(const struct vkb_run *run)
{
    return run->input ? run->input->version : run->frame->scene.serial;
}

// A copy of the point's passes, for it may be gone when the next one comes.
static bool keep_previous(struct vkb_run *run, struct vkb_error *error)
{
    struct vkb_previous *previous = &run->frame->previous;
    struct vkb_graph *graph = &previous->graph;

    graph->pass_count = 0;
    if (!vkb_grow(error, &graph->passes, &graph->pass_capacity, run->graph->pass_count,
                  sizeof *graph->passes))
        return false;
    memcpy(graph->passes, run->graph->passes, run->graph->pass_count * sizeof *graph->passes);
    graph->pass_count = run->graph->pass_count;
    previous->source = source_version(run);
    return true;
}

// `next` is the point after it, NULL after the last.
static bool record_point(struct vkb_run *run, struct vkb_point *point, const struct vkb_point *next,
                         struct vkb_error *error)
{
    struct vkb_flight *flight = run->flight;
    const struct vkb_previous *previous = &run->frame->previous;
    const struct vkb_neighbours neighbours = {
        .previous = previous->source == source_version(run) ? &previous->graph : NULL,
        .next = next ? &next->graph : NULL,
    };

    run->point = point;
    run->graph = &point->graph;
    point->timing_count = 0;
    point->first_span = flight->timer.span_count;
    if (!mark_current(run, error)
        || !vkb_plan(run->graph, &neighbours, point->outputs, point->output_count, run->current,
                     run->needed, run->wanted, error)
        || !keep_previous(run, error))
        return false;
    for (uint32_t i = 0; i < run->graph->image_count; ++i)
        if (run->wanted[i] && !resolve(run, i, error))
            return false;
    if (!record_passes(run, error))
        return false;
    for (uint32_t i = 0; i < point->output_count; ++i)
        vkb_readback_record(run->device, flight->commands.buffer, &flight->readback,
                            &run->slots[point->outputs[i].image]->image, &point->outputs[i]);
    return true;
}

static bool record_and_submit(struct vkb_run *run, struct vkb_point *points, uint32_t point_count,
                              struct vkb_error *error)
{
    struct vkb_device *device = run->device;
    struct vkb_flight *flight = run->flight;
    VkCommandBuffer commands = flight->commands.buffer;

    if (!vkb_commands_begin(device, &flight->commands, error))
        return false;
    vkb_timer_reset(device, commands, &flight->timer);
    if (run->send_input)
        record_input(run);
    for (uint32_t i = 0; i < point_count; ++i)
        if (!record_point(run, &points[i], i + 1 < point_count ? &points[i + 1] : NULL, error))
            return false;
    vkb_barrier_record_host_read(device, commands);
    return vkb_buffer_flush(device, &flight->uniforms, error)
        && vkb_flight_submit(device, flight, error);
}

static bool submit(struct vkb_run *run, const struct vkb_frame_source *source,
                   struct vkb_point *points, uint32_t point_count, struct vkb_error *error)
{
    run->graph = &points[0].graph;
    return (!source->scene || load_scene(run, source->scene, error))
        && (!source->input || stage_input(run, source->input, error))
        && reserve(run, points, point_count, error)
        && record_and_submit(run, points, point_count, error);
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
                      const struct vkb_frame_source *source, struct vkb_point *points,
                      uint32_t point_count, struct vkb_flight **flight, struct vkb_error *error)
{
    struct vkb_run run = {.device = device, .frame = frame};
    const uint32_t image_count = points[0].graph.image_count;
    uint32_t pass_count = 0;
    bool done;

    for (uint32_t i = 0; i < point_count; ++i)
        if (points[i].graph.pass_count > pass_count)
            pass_count = points[i].graph.pass_count;
    if (!renew(device, frame, error)
        || !vkb_flights_take(device, &frame->flights, &run.flight, error))
        return false;
    trim(device, frame, run.flight);
    done = (run.slots = vkb_alloc(error, image_count, sizeof *run.slots))
        && (run.wanted = vkb_alloc(error, image_count, sizeof *run.wanted))
        && (run.needed = vkb_alloc(error, pass_count, sizeof *run.needed))
        && (run.current = vkb_alloc(error, pass_count, sizeof *run.current))
        && submit(&run, source, points, point_count, error);
    vkb_free(run.slots);
    vkb_free(run.wanted);
    vkb_free(run.needed);
    vkb_free(run.current);
    vkb_free(run.recipe);
    if (done) {
        run.flight->points = points;
        run.flight->point_count = point_count;
        *flight = run.flight;
    } else {
        fail_frame(device, frame, run.flight, error);
        vkb_flights_give_back(device, &frame->flights, run.flight);
    }
    return done;
}

// Times of the same name are of steps of one thing: they become one.
static void merge_timings(struct vkb_point *point)
{
    uint32_t count = 0;

    for (uint32_t i = 0; i < point->timing_count; ++i) {
        uint32_t at = 0;
        while (at < count && strcmp(point->timings[at].name, point->timings[i].name) != 0)
            ++at;
        if (at < count)
            point->timings[at].seconds += point->timings[i].seconds;
        else
            point->timings[count++] = point->timings[i];
    }
    point->timing_count = count;
}

// What the device has left for the points of a flight that is over.
static void fetch(const struct vkb_device *device, const struct vkb_flight *flight)
{
    for (uint32_t i = 0; i < flight->point_count; ++i) {
        struct vkb_point *point = &flight->points[i];
        for (uint32_t timing = 0; timing < point->timing_count; ++timing)
            point->timings[timing].seconds =
                vkb_timer_seconds(device, &flight->timer, point->first_span + timing);
        merge_timings(point);
        for (uint32_t output = 0; output < point->output_count; ++output)
            vkb_readback_fetch(&flight->readback, &point->outputs[output]);
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
