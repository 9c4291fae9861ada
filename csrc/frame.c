#include "frame.h"

#include "plan.h"

#include <string.h>

// The state of one submission, and of the point that is being recorded.
struct run {
    struct vkb_device *device;
    struct vkb_frame *frame;
    struct vkb_flight *flight;
    struct vkb_point *point;
    const struct vkb_graph *graph;  // the point's
    struct vkb_slot **slots;        // by the graph's image index
    bool *wanted;                   // by image
    bool *needed, *current;         // by pass
    struct vkb_slot *input;         // NULL: none
    bool send_input;                // the device does not have it yet
    unsigned char *recipe;
    size_t recipe_size, recipe_capacity;
};

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

static bool append(struct run *run, const void *bytes, size_t size, struct vkb_error *error)
{
    if (!vkb_grow(error, (void **)&run->recipe, &run->recipe_capacity, run->recipe_size + size, 1))
        return false;
    memcpy(run->recipe + run->recipe_size, bytes, size);
    run->recipe_size += size;
    return true;
}

// What passes first..end-1 make their targets from: their rows, with the versions of what they read
// in place of the graph's indices.
static bool write_recipe(struct run *run, uint32_t first, uint32_t end, struct vkb_error *error)
{
    run->recipe_size = 0;
    for (uint32_t i = first; i < end; ++i) {
        struct vkb_pass_row row;
        uint64_t versions[VKB_MAX_READS + 1] = {0};

        memcpy(&row, &run->graph->passes[i], sizeof row);
        for (uint32_t read = 0; read < row.read_count; ++read)
            versions[read] = run->slots[row.reads[read]]->version;
        if (row.geometry != VKB_GEOMETRY_FULLSCREEN && row.geometry != VKB_GEOMETRY_DISPATCH)
            versions[VKB_MAX_READS] = run->frame->scene.serial;
        memset(row.reads, 0, sizeof row.reads);
        memset(row.targets, 0, sizeof row.targets);
        row.depth = row.depth != VKB_NO_IMAGE;
        if (!append(run, &row, sizeof row, error) || !append(run, versions, sizeof versions, error))
            return false;
    }
    return true;
}

// Whether the image is there and holds what a pass before `end` would make.
static bool is_current(const struct run *run, uint32_t image, uint32_t end)
{
    bool current = run->graph->images[image].input;

    for (uint32_t i = 0; i < end; ++i)
        current = current || (run->current[i] && vkb_pass_writes(&run->graph->passes[i], image));
    return current && run->slots[image];
}

// The slots of a pass's targets, the depth last; returns how many.
static uint32_t target_slots(const struct run *run, const struct vkb_pass_row *pass,
                             struct vkb_slot **slots)
{
    uint32_t count = 0;

    for (uint32_t i = 0; i < pass->target_count; ++i)
        slots[count++] = run->slots[pass->targets[i]];
    if (pass->depth != VKB_NO_IMAGE)
        slots[count++] = run->slots[pass->depth];
    return count;
}

// Copies the pass's parameters to the uniform buffer; returns where they lie in it.
static VkDeviceSize write_params(struct run *run, const struct vkb_pass_row *pass)
{
    const VkDeviceSize align = run->device->limits.minUniformBufferOffsetAlignment;
    const VkDeviceSize offset = run->flight->uniform_used;
    const size_t size = vkb_block_sizes[pass->block];

    memcpy((char *)run->flight->uniforms.mapped + offset, &pass->params, size);
    run->flight->uniform_used = (offset + size + align - 1) / align * align;
    return offset;
}

// What the pass reads at binding index + 1; `surface` is whose textures those are, if any.
static VkDescriptorImageInfo read_image(const struct run *run, const struct vkb_pass_row *pass,
                                        const struct vkb_surface *surface, uint32_t index)
{
    const struct vkb_scene *scene = &run->frame->scene;
    const struct vkb_image *image;
    VkSampler sampler = run->frame->pipelines.sampler;

    if (surface) {
        const struct vkb_texture *texture =
            &scene->textures[index == 0 ? surface->base : surface->emission];
        image = &texture->image;
        sampler = texture->sampler;
    } else if (pass->geometry == VKB_GEOMETRY_SKYBOX) {
        image = &scene->sky;
    } else {
        image = &run->slots[pass->reads[index]]->image;
    }
    return (VkDescriptorImageInfo){
        .sampler = sampler,
        .imageView = image->view,
        .imageLayout = vkb_image_layout(image, vkb_pass_reads_as(pass)),
    };
}

// A descriptor set with the pass's parameters, which lie at that offset, and what it reads.
static bool bind_descriptors(struct run *run, const struct vkb_pass_row *pass,
                             VkDeviceSize params_offset, const struct vkb_surface *surface,
                             struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &run->device->vk;
    const struct vkb_pipelines *pipelines = &run->frame->pipelines;
    const VkDescriptorSetLayout layout = vkb_pipelines_set_layout(pipelines, pass);
    const uint32_t image_count = vkb_pass_descriptor_images(pass);
    VkDescriptorImageInfo images[VKB_MAX_READS + 1];
    VkWriteDescriptorSet writes[VKB_MAX_READS + 2];
    uint32_t write_count = 0;
    VkDescriptorSet set;

    if (!VK(error, vk->vkAllocateDescriptorSets(
                       run->device->handle,
                       &(VkDescriptorSetAllocateInfo){
                           .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                           .descriptorPool = run->flight->descriptors,
                           .descriptorSetCount = 1,
                           .pSetLayouts = &layout,
                       },
                       &set)))
        return false;
    VkDescriptorBufferInfo params = {
        .buffer = run->flight->uniforms.handle,
        .offset = params_offset,
        .range = vkb_block_sizes[pass->block],
    };
    if (pass->block != VKB_BLOCK_NONE)
        writes[write_count++] = (VkWriteDescriptorSet){
            .sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
            .dstSet = set,
            .dstBinding = 0,
            .descriptorCount = 1,
            .descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER,
            .pBufferInfo = &params,
        };
    for (uint32_t i = 0; i < image_count; ++i) {
        images[i] = read_image(run, pass, surface, i);
        writes[write_count++] = (VkWriteDescriptorSet){
            .sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
            .dstSet = set,
            .dstBinding = i + 1,
            .descriptorCount = 1,
            .descriptorType = pass->loads ? VK_DESCRIPTOR_TYPE_STORAGE_IMAGE
                                          : VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
            .pImageInfo = &images[i],
        };
    }
    if (pass->geometry == VKB_GEOMETRY_DISPATCH) {
        const struct vkb_image *target = &run->slots[pass->targets[0]]->image;
        images[image_count] = (VkDescriptorImageInfo){
            .imageView = target->view,
            .imageLayout = vkb_image_layout(target, VKB_ACCESS_DISPATCH_STORED),
        };
        writes[write_count++] = (VkWriteDescriptorSet){
            .sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
            .dstSet = set,
            .dstBinding = image_count + 1,
            .descriptorCount = 1,
            .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_IMAGE,
            .pImageInfo = &images[image_count],
        };
    }
    vk->vkUpdateDescriptorSets(run->device->handle, write_count, writes, 0, NULL);
    vk->vkCmdBindDescriptorSets(run->flight->commands.buffer, vkb_pass_bind_point(pass),
                                vkb_pipelines_layout(pipelines, pass), 0, 1, &set, 0, NULL);
    return true;
}

static void bind_mesh(const struct run *run, const struct vkb_mesh *mesh, bool textured)
{
    const struct VolkDeviceTable *vk = &run->device->vk;
    VkCommandBuffer commands = run->flight->commands.buffer;

    vk->vkCmdBindVertexBuffers(commands, 0, 1, &mesh->vertices.handle, &(VkDeviceSize){0});
    if (textured)
        vk->vkCmdBindVertexBuffers(commands, 1, 1, &mesh->texcoords.handle, &(VkDeviceSize){0});
    vk->vkCmdBindIndexBuffer(commands, mesh->indices.handle, 0, VK_INDEX_TYPE_UINT32);
}

// A draw for each surface, with its textures.
static bool draw_surfaces(struct run *run, const struct vkb_pass_row *pass,
                          const struct vkb_mesh *mesh, VkDeviceSize params, struct vkb_error *error)
{
    uint32_t first = mesh->plain_count;

    bind_mesh(run, mesh, true);
    for (uint32_t i = 0; i < mesh->surface_count; ++i) {
        const struct vkb_surface *surface = &mesh->surfaces[i];
        if (!bind_descriptors(run, pass, params, surface, error))
            return false;
        run->device->vk.vkCmdDrawIndexed(run->flight->commands.buffer, surface->index_count, 1,
                                         first, 0, 0);
        first += surface->index_count;
    }
    return true;
}

static void dispatch(const struct run *run, const struct vkb_pass_row *pass)
{
    const struct vkb_image_row *target = &run->graph->images[pass->targets[0]];

    run->device->vk.vkCmdDispatch(
        run->flight->commands.buffer, (target->width + pass->block_width - 1) / pass->block_width,
        (target->height + pass->block_height - 1) / pass->block_height, 1);
}

static bool draw(struct run *run, const struct vkb_pass_row *pass, VkDeviceSize params,
                 struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &run->device->vk;
    VkCommandBuffer commands = run->flight->commands.buffer;
    const struct vkb_scene *scene = &run->frame->scene;
    const struct vkb_mesh *mesh = pass->geometry == VKB_GEOMETRY_GLOW ? &scene->glow : &scene->body;

    if (pass->textured)
        return draw_surfaces(run, pass, mesh, params, error);
    if (!bind_descriptors(run, pass, params, NULL, error))
        return false;
    if (pass->geometry == VKB_GEOMETRY_DISPATCH) {
        dispatch(run, pass);
    } else if (!vkb_is_mesh(pass->geometry)) {
        vk->vkCmdDraw(commands, pass->geometry == VKB_GEOMETRY_SKYBOX ? 36 : 3, 1, 0, 0);
    } else if (mesh->plain_count > 0) {
        bind_mesh(run, mesh, false);
        vk->vkCmdDrawIndexed(commands, mesh->plain_count, 1, 0, 0, 0);
    }
    return true;
}

static bool record_pass(struct run *run, uint32_t index, VkRenderPass render_pass,
                        struct vkb_error *error)
{
    const struct vkb_pass_row *pass = &run->graph->passes[index];
    VkPipeline pipeline;

    if (!vkb_pipelines_get(run->device, &run->frame->pipelines, pass, render_pass, &pipeline,
                           error))
        return false;
    run->device->vk.vkCmdBindPipeline(run->flight->commands.buffer, vkb_pass_bind_point(pass),
                                      pipeline);
    return draw(run, pass, write_params(run, pass), error);
}

static void transition_reads(struct run *run, uint32_t first, uint32_t end)
{
    for (uint32_t i = first; i < end; ++i) {
        const struct vkb_pass_row *pass = &run->graph->passes[i];
        for (uint32_t read = 0; read < pass->read_count; ++read)
            vkb_image_transition(run->device, run->flight->commands.buffer,
                                 &run->slots[pass->reads[read]]->image, vkb_pass_reads_as(pass));
    }
}

// What the passes read, and the targets in the state that the render pass's dependencies go on
// from.
static void transition_images(struct run *run, uint32_t first, uint32_t end)
{
    VkCommandBuffer commands = run->flight->commands.buffer;
    const struct vkb_pass_row *pass = &run->graph->passes[first];
    struct vkb_target_use uses[VKB_MAX_TARGETS + 1];
    const uint32_t use_count = vkb_graph_target_uses(run->graph, first, end, uses);
    const uint32_t depth_uses = use_count - pass->target_count;

    transition_reads(run, first, end);
    for (uint32_t i = 0; i < use_count; ++i) {
        uint32_t target = i < depth_uses ? pass->depth : pass->targets[i - depth_uses];
        struct vkb_image *image = &run->slots[target]->image;
        // A new image has nothing to wait for; any other must be where its graph lets it rest.
        if (image->access != VKB_ACCESS_NONE && image->access != uses[i].before)
            vkb_image_transition(run->device, commands, image, uses[i].before);
        image->access = uses[i].after == VKB_ACCESS_NONE ? uses[i].during : uses[i].after;
    }
}

static void begin_render_pass(const struct run *run, VkRenderPass render_pass,
                              VkFramebuffer framebuffer, const struct vkb_pass_row *pass,
                              VkExtent2D extent)
{
    const struct VolkDeviceTable *vk = &run->device->vk;
    VkCommandBuffer commands = run->flight->commands.buffer;
    VkClearValue clears[VKB_MAX_TARGETS + 1];

    for (uint32_t i = 0; i < pass->target_count; ++i)
        clears[i] = (VkClearValue){.color = {.float32 = {0.0f, 0.0f, 0.0f, 1.0f}}};
    clears[pass->target_count] = (VkClearValue){.depthStencil = {.depth = 1.0f}};
    vk->vkCmdBeginRenderPass(commands,
                             &(VkRenderPassBeginInfo){
                                 .sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO,
                                 .renderPass = render_pass,
                                 .framebuffer = framebuffer,
                                 .renderArea = {.extent = extent},
                                 .clearValueCount = pass->target_count + 1,
                                 .pClearValues = clears,
                             },
                             VK_SUBPASS_CONTENTS_INLINE);
    vk->vkCmdSetViewport(commands, 0, 1,
                         &(VkViewport){
                             .width = (float)extent.width,
                             .height = (float)extent.height,
                             .maxDepth = 1.0f,
                         });
    vk->vkCmdSetScissor(commands, 0, 1, &(VkRect2D){.extent = extent});
}

// The render pass just recorded goes by the name of the image that it writes, a dispatch by its
// own.
static void add_timing(struct run *run, uint32_t first)
{
    const struct vkb_pass_row *pass = &run->graph->passes[first];
    struct vkb_timing *timing = &run->point->timings[run->point->timing_count++];

    memcpy(timing->name,
           pass->geometry == VKB_GEOMETRY_DISPATCH ? pass->name
                                                   : run->graph->images[pass->targets[0]].name,
           sizeof timing->name);
}

static bool record_dispatch(struct run *run, uint32_t index, struct vkb_error *error)
{
    struct vkb_device *device = run->device;
    struct vkb_flight *flight = run->flight;
    VkCommandBuffer commands = flight->commands.buffer;

    // Started before the barriers: on lavapipe a timestamp is taken at the next barrier.
    vkb_timer_start(device, commands, &flight->timer);
    transition_reads(run, index, index + 1);
    vkb_image_transition(device, commands, &run->slots[run->graph->passes[index].targets[0]]->image,
                         VKB_ACCESS_DISPATCH_STORED);
    if (!record_pass(run, index, VK_NULL_HANDLE, error))
        return false;
    vkb_timer_stop(device, commands, &flight->timer);
    return true;
}

// Passes first..end-1 in one render pass, timed as one: within a render pass tiling devices and
// lavapipe do not keep the order that single draws could be timed by.
static bool record_render_pass(struct run *run, uint32_t first, uint32_t end,
                               struct vkb_slot **targets, uint32_t target_count,
                               struct vkb_error *error)
{
    struct vkb_device *device = run->device;
    struct vkb_frame *frame = run->frame;
    struct vkb_flight *flight = run->flight;
    VkCommandBuffer commands = flight->commands.buffer;
    VkRenderPass render_pass;
    VkFramebuffer framebuffer;

    if (!vkb_pipelines_render_pass(device, &frame->pipelines, run->graph, first, end, &render_pass,
                                   error)
        || !vkb_slots_framebuffer(device, &frame->slots, targets, target_count, render_pass,
                                  &framebuffer, error))
        return false;
    transition_images(run, first, end);
    vkb_timer_start(device, commands, &flight->timer);
    begin_render_pass(run, render_pass, framebuffer, &run->graph->passes[first],
                      (VkExtent2D){targets[0]->image.width, targets[0]->image.height});
    for (uint32_t i = first; i < end; ++i)
        if (!record_pass(run, i, render_pass, error))
            return false;
    device->vk.vkCmdEndRenderPass(commands);
    vkb_timer_stop(device, commands, &flight->timer);
    return true;
}

static bool record_group(struct run *run, uint32_t first, uint32_t end, struct vkb_slot **targets,
                         uint32_t target_count, struct vkb_error *error)
{
    const bool is_dispatch = run->graph->passes[first].geometry == VKB_GEOMETRY_DISPATCH;

    for (uint32_t i = 0; i < target_count; ++i)
        if (!vkb_slot_begin_writing(&run->frame->slots, targets[i], run->recipe, run->recipe_size,
                                    error))
            return false;
    if (is_dispatch ? !record_dispatch(run, first, error)
                    : !record_render_pass(run, first, end, targets, target_count, error))
        return false;
    add_timing(run, first);
    for (uint32_t i = 0; i < target_count; ++i)
        targets[i]->valid = true;
    return true;
}

// Finds out which passes have nothing to do, from the first to the last: their targets hold what
// the recipe says, and all that they read is so too.
static bool mark_current(struct run *run, struct vkb_error *error)
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

static bool record_passes(struct run *run, struct vkb_error *error)
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
        if (!current && !record_group(run, first, end, targets, target_count, error))
            return false;
    }
    return true;
}

static bool reserve_descriptors(struct run *run, uint32_t sets, struct vkb_error *error)
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
static bool reserve(struct run *run, struct vkb_point *points, uint32_t point_count,
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
static bool resolve(struct run *run, uint32_t image, struct vkb_error *error)
{
    const struct vkb_image_row *row = &run->graph->images[image];
    struct vkb_slots *slots = &run->frame->slots;

    return (!vkb_slots_replaces(slots, row)
            || vkb_flights_land(run->device, &run->frame->flights, error))
        && vkb_slots_resolve(run->device, slots, row, &run->slots[image], error);
}

static bool load_scene(struct run *run, const struct vkb_scene_data *data, struct vkb_error *error)
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
static bool stage_input(struct run *run, const struct vkb_input *input, struct vkb_error *error)
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

static void record_input(struct run *run)
{
    if (!run->input->image.mapped)
        vkb_upload_record(run->device, run->flight->commands.buffer, &run->frame->upload,
                          &run->input->image);
    run->input->valid = true;
}

static uint64_t source_version(const struct run *run)
{
    return run->input ? run->input->version : run->frame->scene.serial;
}

// A copy of the point's passes, for it may be gone when the next one comes.
static bool keep_previous(struct run *run, struct vkb_error *error)
{
    struct vkb_previous *previous = &run->frame->previous;
    struct vkb_graph *graph = &previous->graph;

    graph->pass_count = 0;
    if (!vkb_grow(error, (void **)&graph->passes, &graph->pass_capacity, run->graph->pass_count,
                  sizeof *graph->passes))
        return false;
    memcpy(graph->passes, run->graph->passes, run->graph->pass_count * sizeof *graph->passes);
    graph->pass_count = run->graph->pass_count;
    previous->source = source_version(run);
    return true;
}

// `next` is the point after it, NULL after the last.
static bool record_point(struct run *run, struct vkb_point *point, const struct vkb_point *next,
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

static bool record_and_submit(struct run *run, struct vkb_point *points, uint32_t point_count,
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

static bool submit(struct run *run, const struct vkb_frame_source *source, struct vkb_point *points,
                   uint32_t point_count, struct vkb_error *error)
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

bool vkb_frame_submit(struct vkb_device *device, struct vkb_frame *frame,
                      const struct vkb_frame_source *source, struct vkb_point *points,
                      uint32_t point_count, struct vkb_flight **flight, struct vkb_error *error)
{
    struct run run = {.device = device, .frame = frame};
    const uint32_t image_count = points[0].graph.image_count;
    uint32_t pass_count = 0;
    bool done;

    for (uint32_t i = 0; i < point_count; ++i)
        if (points[i].graph.pass_count > pass_count)
            pass_count = points[i].graph.pass_count;
    if (!renew(device, frame, error)
        || !vkb_flights_take(device, &frame->flights, &run.flight, error))
        return false;
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

bool vkb_frame_land(struct vkb_device *device, struct vkb_frame *frame, struct vkb_error *error)
{
    return vkb_flights_land(device, &frame->flights, error);
}
