#include "frame.h"

#include <string.h>

// The state of one run.
struct run {
    struct vkb_device *device;
    struct vkb_frame *frame;
    const struct vkb_graph *graph;
    struct vkb_slot **slots;  // by the graph's image index
    bool *needed;             // by pass
    uint32_t *ran;            // the first pass of each render pass that was recorded
    uint32_t ran_count;
    struct vkb_slot *input;  // NULL: none, or none that is needed
    bool send_input;         // the device does not have it yet
    VkDeviceSize uniform_used;
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
    vkb_slots_destroy(device, &frame->slots);
    vkb_timer_destroy(device, &frame->timer);
    device->vk.vkDestroyDescriptorPool(device->handle, frame->descriptors, NULL);
    vkb_buffer_destroy(device, &frame->uniforms);
    vkb_readback_destroy(device, &frame->readback);
    vkb_upload_destroy(device, &frame->upload);
    vkb_scene_destroy(device, &frame->scene);
    vkb_pipelines_destroy(device, &frame->pipelines);
    vkb_commands_destroy(device, &frame->commands);
    *frame = (struct vkb_frame){0};
}

// Marks the passes that the outputs depend on, from the last to the first, and their images.
static void mark_needed(struct run *run, const struct vkb_output *outputs, uint32_t output_count,
                        bool *wanted)
{
    const struct vkb_graph *graph = run->graph;

    for (uint32_t i = 0; i < output_count; ++i)
        wanted[outputs[i].image] = true;
    for (uint32_t i = graph->pass_count; i-- > 0;) {
        const struct vkb_pass_row *pass = &graph->passes[i];
        for (uint32_t target = 0; target < pass->target_count; ++target)
            run->needed[i] |= wanted[pass->targets[target]];
        run->needed[i] |= pass->depth != VKB_NO_IMAGE && wanted[pass->depth];
        if (!run->needed[i])
            continue;
        for (uint32_t read = 0; read < pass->read_count; ++read)
            wanted[pass->reads[read]] = true;
        for (uint32_t target = 0; target < pass->target_count; ++target)
            wanted[pass->targets[target]] = true;
        if (pass->depth != VKB_NO_IMAGE)
            wanted[pass->depth] = true;
    }
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
        if (row.geometry != VKB_GEOMETRY_FULLSCREEN)
            versions[VKB_MAX_READS] = run->frame->scene.serial;
        memset(row.reads, 0, sizeof row.reads);
        memset(row.targets, 0, sizeof row.targets);
        row.depth = row.depth != VKB_NO_IMAGE;
        if (!append(run, &row, sizeof row, error) || !append(run, versions, sizeof versions, error))
            return false;
    }
    return true;
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
    const VkDeviceSize offset = run->uniform_used;
    const size_t size = vkb_block_sizes[pass->block];

    memcpy((char *)run->frame->uniforms.mapped + offset, &pass->params, size);
    run->uniform_used = (offset + size + align - 1) / align * align;
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
        .imageLayout = vkb_access_layout(VKB_ACCESS_SAMPLED),
    };
}

// A descriptor set with the pass's parameters, which lie at that offset, and what it reads.
static bool bind_descriptors(struct run *run, const struct vkb_pass_row *pass,
                             VkDeviceSize params_offset, const struct vkb_surface *surface,
                             struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &run->device->vk;
    const struct vkb_pipelines *pipelines = &run->frame->pipelines;
    const uint32_t image_count = vkb_pass_descriptor_images(pass);
    VkDescriptorImageInfo images[VKB_MAX_READS];
    VkWriteDescriptorSet writes[VKB_MAX_READS + 1];
    uint32_t write_count = 0;
    VkDescriptorSet set;

    if (!VK(error, vk->vkAllocateDescriptorSets(
                       run->device->handle,
                       &(VkDescriptorSetAllocateInfo){
                           .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                           .descriptorPool = run->frame->descriptors,
                           .descriptorSetCount = 1,
                           .pSetLayouts = &pipelines->set_layouts[image_count],
                       },
                       &set)))
        return false;
    VkDescriptorBufferInfo params = {
        .buffer = run->frame->uniforms.handle,
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
            .descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
            .pImageInfo = &images[i],
        };
    }
    vk->vkUpdateDescriptorSets(run->device->handle, write_count, writes, 0, NULL);
    vk->vkCmdBindDescriptorSets(run->frame->commands.buffer, VK_PIPELINE_BIND_POINT_GRAPHICS,
                                pipelines->layouts[image_count], 0, 1, &set, 0, NULL);
    return true;
}

static void bind_mesh(const struct run *run, const struct vkb_mesh *mesh, bool textured)
{
    const struct VolkDeviceTable *vk = &run->device->vk;
    VkCommandBuffer commands = run->frame->commands.buffer;

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
        run->device->vk.vkCmdDrawIndexed(run->frame->commands.buffer, surface->index_count, 1,
                                         first, 0, 0);
        first += surface->index_count;
    }
    return true;
}

static bool draw(struct run *run, const struct vkb_pass_row *pass, VkDeviceSize params,
                 struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &run->device->vk;
    VkCommandBuffer commands = run->frame->commands.buffer;
    const struct vkb_scene *scene = &run->frame->scene;
    const struct vkb_mesh *mesh = pass->geometry == VKB_GEOMETRY_GLOW ? &scene->glow : &scene->body;

    if (pass->textured)
        return draw_surfaces(run, pass, mesh, params, error);
    if (!bind_descriptors(run, pass, params, NULL, error))
        return false;
    if (!vkb_is_mesh(pass->geometry)) {
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
    run->device->vk.vkCmdBindPipeline(run->frame->commands.buffer, VK_PIPELINE_BIND_POINT_GRAPHICS,
                                      pipeline);
    return draw(run, pass, write_params(run, pass), error);
}

// What the passes read, and the targets in the state that the render pass's dependencies go on
// from.
static void transition_images(struct run *run, uint32_t first, uint32_t end)
{
    VkCommandBuffer commands = run->frame->commands.buffer;
    const struct vkb_pass_row *pass = &run->graph->passes[first];
    struct vkb_target_use uses[VKB_MAX_TARGETS + 1];
    const uint32_t use_count = vkb_graph_target_uses(run->graph, first, end, uses);
    const uint32_t depth_uses = use_count - pass->target_count;

    for (uint32_t i = first; i < end; ++i)
        for (uint32_t read = 0; read < run->graph->passes[i].read_count; ++read)
            vkb_image_transition(run->device, commands,
                                 &run->slots[run->graph->passes[i].reads[read]]->image,
                                 VKB_ACCESS_SAMPLED);
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
    VkCommandBuffer commands = run->frame->commands.buffer;
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

// Passes first..end-1 in one render pass, timed as one: within a render pass tiling devices and
// lavapipe do not keep the order that single draws could be timed by.
static bool record_group(struct run *run, uint32_t first, uint32_t end, struct vkb_slot **targets,
                         uint32_t target_count, struct vkb_error *error)
{
    struct vkb_device *device = run->device;
    struct vkb_frame *frame = run->frame;
    VkCommandBuffer commands = frame->commands.buffer;
    VkRenderPass render_pass;
    VkFramebuffer framebuffer;

    for (uint32_t i = 0; i < target_count; ++i)
        if (!vkb_slot_begin_writing(&frame->slots, targets[i], run->recipe, run->recipe_size,
                                    error))
            return false;
    if (!vkb_pipelines_render_pass(device, &frame->pipelines, run->graph, first, end, &render_pass,
                                   error)
        || !vkb_slot_framebuffer(device, targets, target_count, render_pass, &framebuffer, error))
        return false;
    transition_images(run, first, end);
    vkb_timer_start(device, commands, &frame->timer, run->ran_count);
    begin_render_pass(run, render_pass, framebuffer, &run->graph->passes[first],
                      (VkExtent2D){targets[0]->image.width, targets[0]->image.height});
    for (uint32_t i = first; i < end; ++i)
        if (!record_pass(run, i, render_pass, error))
            return false;
    device->vk.vkCmdEndRenderPass(commands);
    vkb_timer_stop(device, commands, &frame->timer, run->ran_count);
    run->ran[run->ran_count++] = first;
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

static bool reserve_descriptors(struct run *run, struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &run->device->vk;
    struct vkb_frame *frame = run->frame;
    const uint32_t sets =
        run->graph->pass_count + frame->scene.body.surface_count + frame->scene.glow.surface_count;

    if (sets <= frame->descriptor_capacity)
        return VK(error, vk->vkResetDescriptorPool(run->device->handle, frame->descriptors, 0));
    vk->vkDestroyDescriptorPool(run->device->handle, frame->descriptors, NULL);
    frame->descriptors = VK_NULL_HANDLE;
    frame->descriptor_capacity = 0;
    if (!VK(error,
            vk->vkCreateDescriptorPool(
                run->device->handle,
                &(VkDescriptorPoolCreateInfo){
                    .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
                    .maxSets = sets,
                    .poolSizeCount = 2,
                    .pPoolSizes =
                        (VkDescriptorPoolSize[]){
                            {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, sets},
                            {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, sets * VKB_MAX_READS},
                        },
                },
                NULL, &frame->descriptors)))
        return false;
    frame->descriptor_capacity = sets;
    return true;
}

static bool reserve(struct run *run, const struct vkb_output *outputs, uint32_t output_count,
                    struct vkb_error *error)
{
    const VkDeviceSize align = run->device->limits.minUniformBufferOffsetAlignment;
    const VkDeviceSize params = (sizeof(union vkb_params) + align - 1) / align * align;
    VkDeviceSize readback = 0;

    for (uint32_t i = 0; i < output_count; ++i) {
        const struct vkb_image_row *row = &run->graph->images[outputs[i].image];
        readback += vkb_readback_size(row->format, row->width, row->height);
    }
    return reserve_descriptors(run, error)
        && vkb_timer_reserve(run->device, run->graph->pass_count, &run->frame->timer, error)
        && vkb_buffer_reserve(run->device, VKB_MEMORY_UPLOAD, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT,
                              params * run->graph->pass_count, &run->frame->uniforms, error)
        && vkb_readback_begin(run->device, &run->frame->readback, readback, error);
}

// The images that this run wrote now hold what their recipes say.
static void end_writing(struct run *run)
{
    struct vkb_slot *targets[VKB_MAX_TARGETS + 1] = {0};

    for (uint32_t i = 0; i < run->ran_count; ++i)
        for (uint32_t t = target_slots(run, &run->graph->passes[run->ran[i]], targets); t-- > 0;)
            targets[t]->valid = true;
    if (run->input)
        run->input->valid = true;
}

// One time a render pass, under the name of the image that it writes.
static bool read_timings(const struct run *run, struct vkb_timing *timings, struct vkb_error *error)
{
    for (uint32_t i = 0; i < run->ran_count; ++i) {
        const struct vkb_pass_row *pass = &run->graph->passes[run->ran[i]];
        memcpy(timings[i].name, run->slots[pass->targets[0]]->name, sizeof timings[i].name);
        if (!vkb_timer_read(run->device, &run->frame->timer, i, &timings[i].seconds, error))
            return false;
    }
    return true;
}

static bool record_and_run(struct run *run, const struct vkb_output *outputs, uint32_t output_count,
                           VkDeviceSize *offsets, struct vkb_error *error)
{
    struct vkb_device *device = run->device;
    struct vkb_frame *frame = run->frame;
    VkCommandBuffer commands = frame->commands.buffer;

    if (!vkb_commands_begin(device, &frame->commands, error))
        return false;
    vkb_timer_reset(device, commands, &frame->timer);
    if (run->send_input)
        vkb_upload_record(device, commands, &frame->upload, &run->input->image);
    if (!record_passes(run, error))
        return false;
    for (uint32_t i = 0; i < output_count; ++i)
        vkb_readback_record(device, commands, &frame->readback,
                            &run->slots[outputs[i].image]->image, &offsets[i]);
    vkb_barrier_record_host_read(device, commands);
    return vkb_buffer_flush(device, &frame->uniforms, error)
        && vkb_commands_run(device, &frame->commands, error)
        && vkb_buffer_invalidate(device, &frame->readback.staging, error);
}

// Stages the image and finds out whether the device has it already.
static bool stage_input(struct run *run, const struct vkb_input *input, struct vkb_error *error)
{
    bool changed;

    if (!vkb_upload_stage(run->device, &run->frame->upload, input, &changed, error))
        return false;
    for (uint32_t i = 0; i < run->graph->image_count; ++i)
        if (run->graph->images[i].input)
            run->input = run->slots[i];
    run->send_input = run->input && (changed || !run->input->valid);
    return !run->send_input
        || vkb_slot_begin_writing(&run->frame->slots, run->input, NULL, 0, error);
}

static bool run_frame(struct run *run, const struct vkb_frame_source *source,
                      const struct vkb_output *outputs, uint32_t output_count, bool *wanted,
                      VkDeviceSize *offsets, struct vkb_timing *timings, struct vkb_error *error)
{
    struct vkb_frame *frame = run->frame;

    if (!frame->commands.pool && !vkb_commands_create(run->device, &frame->commands, error))
        return false;
    if (source->scene
        && !vkb_scene_load(run->device, &frame->commands, source->scene, &frame->scene, error))
        return false;
    mark_needed(run, outputs, output_count, wanted);
    for (uint32_t i = 0; i < run->graph->image_count; ++i)
        if (wanted[i]
            && !vkb_slots_resolve(run->device, &frame->slots, &run->graph->images[i],
                                  &run->slots[i], error))
            return false;
    if (source->input && !stage_input(run, source->input, error))
        return false;
    if (!reserve(run, outputs, output_count, error)
        || !record_and_run(run, outputs, output_count, offsets, error)
        || !read_timings(run, timings, error))
        return false;
    for (uint32_t i = 0; i < output_count; ++i)
        vkb_readback_fetch(&frame->readback, offsets[i], &run->slots[outputs[i].image]->image,
                           &outputs[i]);
    end_writing(run);
    return true;
}

// After a failure nothing is known of what the device did: images and commands are made anew.
static void recover(struct vkb_device *device, struct vkb_frame *frame)
{
    if (frame->commands.pool)
        device->vk.vkDeviceWaitIdle(device->handle);
    vkb_slots_destroy(device, &frame->slots);
    vkb_commands_destroy(device, &frame->commands);
}

bool vkb_frame_run(struct vkb_device *device, struct vkb_frame *frame,
                   const struct vkb_frame_source *source, const struct vkb_graph *graph,
                   const struct vkb_output *outputs, uint32_t output_count,
                   struct vkb_timing *timings, uint32_t *timing_count, struct vkb_error *error)
{
    struct run run = {.device = device, .frame = frame, .graph = graph};
    bool *wanted = NULL;
    VkDeviceSize *offsets = NULL;
    bool done;

    *timing_count = 0;
    if (output_count == 0)
        return true;
    done = (run.slots = vkb_alloc(error, graph->image_count, sizeof *run.slots))
        && (run.needed = vkb_alloc(error, graph->pass_count, sizeof *run.needed))
        && (run.ran = vkb_alloc(error, graph->pass_count, sizeof *run.ran))
        && (wanted = vkb_alloc(error, graph->image_count, sizeof *wanted))
        && (offsets = vkb_alloc(error, output_count, sizeof *offsets))
        && run_frame(&run, source, outputs, output_count, wanted, offsets, timings, error);
    if (done)
        *timing_count = run.ran_count;
    else
        recover(device, frame);
    vkb_free(run.slots);
    vkb_free(run.needed);
    vkb_free(run.ran);
    vkb_free(run.recipe);
    vkb_free(wanted);
    vkb_free(offsets);
    return done;
}
