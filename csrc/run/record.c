#include "run/record.h"

#include <string.h>

// Copies the pass's parameters to the uniform buffer; returns where they lie in it.
static VkDeviceSize write_params(struct vkb_run *run, const struct vkb_pass_row *pass)
{
    const VkDeviceSize align = run->device->limits.minUniformBufferOffsetAlignment;
    const VkDeviceSize offset = run->submission->uniform_used;
    const size_t size = vkb_block_sizes[pass->block];

    memcpy((char *)run->submission->uniforms.mapped + offset, &pass->params, size);
    run->submission->uniform_used = (offset + size + align - 1) / align * align;
    return offset;
}

// What the pass reads at binding index + 1; `surface` is whose textures those are, if any.
static VkDescriptorImageInfo read_image(const struct vkb_run *run, const struct vkb_pass_row *pass,
                                        const struct vkb_surface *surface, uint32_t index)
{
    const struct vkb_scene *scene = &run->frame->scene;
    const struct vkb_texture *texture = NULL;
    const struct vkb_image *image;

    if (surface) {
        texture = &scene->textures[index == 0 ? surface->base : surface->emission];
        image = &texture->image;
    } else if (pass->geometry == VKB_GEOMETRY_SKYBOX) {
        image = &scene->sky;
    } else {
        image = &run->images[pass->reads[index]]->image;
    }
    return (VkDescriptorImageInfo){
        .sampler = texture
                     ? texture->sampler
                     : vkb_pipelines_sampler(run->device, &run->frame->pipelines, image->format),
        .imageView = image->view,
        .imageLayout = vkb_image_layout(image, vkb_pass_reads_as(pass)),
    };
}

// Fills the set with the pass's parameters, which lie at that offset, what it reads, and the target
// of a dispatch.
static void write_descriptors(const struct vkb_run *run, const struct vkb_pass_row *pass,
                              VkDeviceSize params_offset, const struct vkb_surface *surface,
                              VkDescriptorSet set)
{
    const uint32_t image_count = vkb_pass_descriptor_images(pass);
    VkDescriptorImageInfo images[VKB_MAX_READS + 1];
    VkWriteDescriptorSet writes[VKB_MAX_READS + 2];
    uint32_t write_count = 0;
    VkDescriptorBufferInfo params = {
        .buffer = run->submission->uniforms.handle,
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
        const struct vkb_image *target = &run->images[pass->targets[0]]->image;
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
    run->device->vk.vkUpdateDescriptorSets(run->device->handle, write_count, writes, 0, NULL);
}

static bool bind_descriptors(struct vkb_run *run, const struct vkb_pass_row *pass,
                             VkDeviceSize params_offset, const struct vkb_surface *surface,
                             struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &run->device->vk;
    const struct vkb_pipelines *pipelines = &run->frame->pipelines;
    const VkDescriptorSetLayout layout = vkb_pipelines_set_layout(pipelines, pass);
    VkDescriptorSet set;

    if (!VK(error, vk->vkAllocateDescriptorSets(
                       run->device->handle,
                       &(VkDescriptorSetAllocateInfo){
                           .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                           .descriptorPool = run->submission->descriptors,
                           .descriptorSetCount = 1,
                           .pSetLayouts = &layout,
                       },
                       &set)))
        return false;
    write_descriptors(run, pass, params_offset, surface, set);
    vk->vkCmdBindDescriptorSets(run->submission->commands.buffer, vkb_pass_bind_point(pass),
                                vkb_pipelines_layout(pipelines, pass), 0, 1, &set, 0, NULL);
    return true;
}

static void bind_mesh(const struct vkb_run *run, const struct vkb_mesh *mesh, bool textured)
{
    const struct VolkDeviceTable *vk = &run->device->vk;
    VkCommandBuffer commands = run->submission->commands.buffer;

    vk->vkCmdBindVertexBuffers(commands, 0, 1, &mesh->vertices.handle, &(VkDeviceSize){0});
    if (textured)
        vk->vkCmdBindVertexBuffers(commands, 1, 1, &mesh->texcoords.handle, &(VkDeviceSize){0});
    vk->vkCmdBindIndexBuffer(commands, mesh->indices.handle, 0, VK_INDEX_TYPE_UINT32);
}

// A draw for each surface, with its textures.
static bool draw_surfaces(struct vkb_run *run, const struct vkb_pass_row *pass,
                          const struct vkb_mesh *mesh, VkDeviceSize params, struct vkb_error *error)
{
    uint32_t first = mesh->plain_count;

    bind_mesh(run, mesh, true);
    for (uint32_t i = 0; i < mesh->surface_count; ++i) {
        const struct vkb_surface *surface = &mesh->surfaces[i];
        if (!bind_descriptors(run, pass, params, surface, error))
            return false;
        run->device->vk.vkCmdDrawIndexed(run->submission->commands.buffer, surface->index_count, 1,
                                         first, 0, 0);
        first += surface->index_count;
    }
    return true;
}

static void dispatch(const struct vkb_run *run, const struct vkb_pass_row *pass)
{
    const struct vkb_image_row *target = &run->graph->images[pass->targets[0]];

    const uint32_t columns = (target->width + pass->block_width - 1) / pass->block_width;
    const uint32_t rows = (target->height + pass->block_height - 1) / pass->block_height;

    run->device->vk.vkCmdDispatch(run->submission->commands.buffer,
                                  pass->groups_width ? pass->groups_width : columns,
                                  pass->groups_height ? pass->groups_height : rows, 1);
}

static bool draw(struct vkb_run *run, const struct vkb_pass_row *pass, VkDeviceSize params,
                 struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &run->device->vk;
    VkCommandBuffer commands = run->submission->commands.buffer;
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

static bool record_pass(struct vkb_run *run, uint32_t index, VkRenderPass render_pass,
                        struct vkb_error *error)
{
    const struct vkb_pass_row *pass = &run->graph->passes[index];
    VkPipeline pipeline;

    if (!vkb_pipelines_get(run->device, &run->frame->pipelines, pass, render_pass, &pipeline,
                           error))
        return false;
    run->device->vk.vkCmdBindPipeline(run->submission->commands.buffer, vkb_pass_bind_point(pass),
                                      pipeline);
    return draw(run, pass, write_params(run, pass), error);
}

static void transition_reads(struct vkb_run *run, uint32_t first, uint32_t end)
{
    for (uint32_t i = first; i < end; ++i) {
        const struct vkb_pass_row *pass = &run->graph->passes[i];
        for (uint32_t read = 0; read < pass->read_count; ++read)
            vkb_image_transition(run->device, run->submission->commands.buffer,
                                 &run->images[pass->reads[read]]->image, vkb_pass_reads_as(pass));
    }
}

// What the passes read, and the targets in the state that the render pass's dependencies go on
// from.
static void transition_images(struct vkb_run *run, uint32_t first, uint32_t end)
{
    VkCommandBuffer commands = run->submission->commands.buffer;
    const struct vkb_pass_row *pass = &run->graph->passes[first];
    struct vkb_target_use uses[VKB_MAX_TARGETS + 1];
    const uint32_t use_count = vkb_graph_target_uses(run->graph, first, end, uses);
    const uint32_t depth_uses = use_count - pass->target_count;

    transition_reads(run, first, end);
    for (uint32_t i = 0; i < use_count; ++i) {
        uint32_t target = i < depth_uses ? pass->depth : pass->targets[i - depth_uses];
        struct vkb_image *image = &run->images[target]->image;
        // A new image has nothing to wait for; any other must be where its graph lets it rest.
        if (image->access != VKB_ACCESS_NONE && image->access != uses[i].before)
            vkb_image_transition(run->device, commands, image, uses[i].before);
        image->access = uses[i].after == VKB_ACCESS_NONE ? uses[i].during : uses[i].after;
    }
}

static void begin_render_pass(const struct vkb_run *run, VkRenderPass render_pass,
                              VkFramebuffer framebuffer, const struct vkb_pass_row *pass,
                              VkExtent2D extent)
{
    const struct VolkDeviceTable *vk = &run->device->vk;
    VkCommandBuffer commands = run->submission->commands.buffer;
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

static void add_timing(struct vkb_run *run, uint32_t first)
{
    struct vkb_timing *timing = &run->request->timings[run->request->timing_count++];

    memcpy(timing->name, vkb_graph_timed_as(run->graph, first), sizeof timing->name);
}

static bool record_dispatch(struct vkb_run *run, uint32_t index, struct vkb_error *error)
{
    struct vkb_device *device = run->device;
    struct vkb_submission *submission = run->submission;
    VkCommandBuffer commands = submission->commands.buffer;

    // Started before the barriers: on lavapipe a timestamp is taken at the next barrier.
    vkb_timer_start(device, commands, &submission->timer);
    transition_reads(run, index, index + 1);
    vkb_image_transition(device, commands,
                         &run->images[run->graph->passes[index].targets[0]]->image,
                         VKB_ACCESS_DISPATCH_STORED);
    if (!record_pass(run, index, VK_NULL_HANDLE, error))
        return false;
    vkb_timer_stop(device, commands, &submission->timer);
    return true;
}

static uint32_t target_images(const struct vkb_run *run, const struct vkb_pass_row *pass,
                              struct vkb_cached_image **cache)
{
    uint32_t targets[VKB_MAX_TARGETS + 1];
    const uint32_t count = vkb_pass_targets(pass, targets);

    for (uint32_t i = 0; i < count; ++i)
        cache[i] = run->images[targets[i]];
    return count;
}

// Passes first..end-1 in one render pass, timed as one: within a render pass tiling devices and
// lavapipe do not keep the order that single draws could be timed by.
static bool record_render_pass(struct vkb_run *run, uint32_t first, uint32_t end,
                               struct vkb_error *error)
{
    struct vkb_device *device = run->device;
    struct vkb_frame *frame = run->frame;
    struct vkb_submission *submission = run->submission;
    VkCommandBuffer commands = submission->commands.buffer;
    struct vkb_cached_image *targets[VKB_MAX_TARGETS + 1];
    const uint32_t target_count = target_images(run, &run->graph->passes[first], targets);
    VkRenderPass render_pass;
    VkFramebuffer framebuffer;

    if (!vkb_pipelines_render_pass(device, &frame->pipelines, run->graph, first, end, &render_pass,
                                   error)
        || !vkb_image_cache_framebuffer(device, &frame->cache, targets, target_count, render_pass,
                                        &framebuffer, error))
        return false;
    transition_images(run, first, end);
    vkb_timer_start(device, commands, &submission->timer);
    begin_render_pass(run, render_pass, framebuffer, &run->graph->passes[first],
                      (VkExtent2D){targets[0]->image.width, targets[0]->image.height});
    for (uint32_t i = first; i < end; ++i)
        if (!record_pass(run, i, render_pass, error))
            return false;
    device->vk.vkCmdEndRenderPass(commands);
    vkb_timer_stop(device, commands, &submission->timer);
    return true;
}

bool vkb_record_group(void *context, uint32_t first, uint32_t end, struct vkb_error *error)
{
    struct vkb_run *run = context;
    const bool is_dispatch = run->graph->passes[first].geometry == VKB_GEOMETRY_DISPATCH;

    if (is_dispatch ? !record_dispatch(run, first, error)
                    : !record_render_pass(run, first, end, error))
        return false;
    add_timing(run, first);
    return true;
}
