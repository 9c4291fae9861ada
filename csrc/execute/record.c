#include "execute/record.h"

#include "execute/transient.h"
#include "vulkan/labels.h"

#include <stdio.h>
#include <string.h>

// Copies the pass's parameters to the uniform buffer; returns their offset.
static VkDeviceSize write_params(struct vkb_run *run, const struct vkb_pass_row *pass)
{
    const VkDeviceSize align = run->device->limits.minUniformBufferOffsetAlignment;
    const VkDeviceSize offset = run->submission->uniform_used;
    const size_t size = vkb_block_sizes[pass->block];

    memcpy((char *)run->submission->uniforms.mapped + offset, &pass->params, size);
    run->submission->uniform_used = (offset + size + align - 1) / align * align;
    return offset;
}

// The image that the pass reads at binding index + 1. `surface` has the textures, if the pass reads
// textures.
static bool read_image(struct vkb_run *run, const struct vkb_pass_row *pass,
                       const struct vkb_surface *surface, uint32_t index,
                       VkDescriptorImageInfo *info, struct vkb_error *error)
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
        image = &run->images[vkb_pass_bound_image(pass, index)]->image;
    }
    *info = (VkDescriptorImageInfo){
        .sampler = texture ? texture->sampler : VK_NULL_HANDLE,
        .imageView = image->view,
        .imageLayout = vkb_image_layout(image, vkb_pass_reads_as(pass)),
    };
    return texture || pass->reading != VKB_READING_SAMPLED
        || vkb_bindings_sampler(run->device, &run->frame->pipelines.bindings, image->format,
                                pass->sampling[index], &info->sampler, error);
}

// Rows of a dispatch's target that one storage buffer descriptor covers, and their place.
struct band {
    VkDescriptorBufferInfo buffer;
    size_t row_pitch;
    uint32_t first, rows;
};

// The content of a descriptor set: the pass, the offset of its parameters in the uniform buffer,
// the surface whose textures it reads, and the band that it stores. The last two may be NULL.
struct binding {
    const struct vkb_pass_row *pass;
    VkDeviceSize params;
    const struct vkb_surface *surface;
    const struct band *band;
};

static void write_resource(const struct vkb_run *run, const struct vkb_resource *resource,
                           VkDescriptorImageInfo *image, VkDescriptorBufferInfo *buffer,
                           VkWriteDescriptorSet *write)
{
    const struct vkb_resource_entry *entry =
        vkb_resources_find(&run->frame->resources, resource->serial);

    *image = (VkDescriptorImageInfo){entry->sampler, entry->image.view, VK_IMAGE_LAYOUT_GENERAL};
    *buffer = (VkDescriptorBufferInfo){.buffer = entry->buffer.handle, .range = VK_WHOLE_SIZE};
    *write = (VkWriteDescriptorSet){
        .pImageInfo = image,
        .pBufferInfo = buffer,
    };
}

// Fills in the descriptor of the image that the pass reads as number `i`.
static bool write_read(struct vkb_run *run, const struct binding *binding, uint32_t i,
                       VkDescriptorImageInfo *info, VkWriteDescriptorSet *write,
                       struct vkb_error *error)
{
    const struct vkb_pass_row *pass = binding->pass;

    *write = (VkWriteDescriptorSet){
        .dstBinding = i + 1,
        .pImageInfo = info,
    };
    if (pass->reading != VKB_READING_LINEAR_TEXELS)
        return read_image(run, pass, binding->surface, i, info, error);
    struct vkb_image *image = &run->images[vkb_pass_bound_image(pass, i)]->image;
    write->pTexelBufferView = &image->linear_texels;
    return vkb_image_linear_texels(run->device, image, error);
}

// Fills the set with the parameters, the images read, the resources, and a dispatch's targets.
static bool write_descriptors(struct vkb_run *run, const struct binding *binding,
                              const struct vkb_pass_layouts *layouts, VkDescriptorSet set,
                              struct vkb_error *error)
{
    const struct vkb_pass_row *pass = binding->pass;
    const uint32_t image_count = vkb_pass_descriptor_images(pass);
    VkDescriptorImageInfo images[VKB_MAX_DESCRIPTORS];
    VkDescriptorBufferInfo buffers[VKB_MAX_RESOURCES];
    VkWriteDescriptorSet writes[VKB_MAX_DESCRIPTORS + 1];
    uint32_t write_count = 0;
    VkDescriptorBufferInfo params = {
        .buffer = run->submission->uniforms.handle,
        .offset = binding->params,
        .range = vkb_block_sizes[pass->block],
    };
    if (pass->block != VKB_BLOCK_NONE)
        writes[write_count++] = (VkWriteDescriptorSet){.pBufferInfo = &params};
    for (uint32_t i = 0; i < image_count; ++i) {
        if (!write_read(run, binding, i, &images[i], &writes[write_count], error))
            return false;
        ++write_count;
    }
    for (uint32_t i = 0; i < pass->resource_count; ++i) {
        write_resource(run, pass->resources[i], &images[image_count + i], &buffers[i],
                       &writes[write_count]);
        writes[write_count].dstBinding = image_count + i + 1;
        ++write_count;
    }
    const uint32_t last = image_count + pass->resource_count;
    for (uint32_t i = 0; i < layouts->stored; ++i) {
        const struct vkb_image *target = &run->images[pass->targets[i]]->image;
        images[last + i] = (VkDescriptorImageInfo){
            .imageView = target->view,
            .imageLayout = vkb_image_layout(target, VKB_ACCESS_DISPATCH_STORED),
        };
        writes[write_count++] = (VkWriteDescriptorSet){
            .dstBinding = TARGET_BINDING + i,
            .pImageInfo = &images[last + i],
            .pBufferInfo = binding->band ? &binding->band->buffer : NULL,
        };
    }
    for (uint32_t i = 0; i < write_count; ++i) {
        writes[i].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        writes[i].dstSet = set;
        writes[i].descriptorCount = 1;
        writes[i].descriptorType = writes[i].dstBinding
                                     ? layouts->descriptors[writes[i].dstBinding - 1]
                                     : VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
    }
    run->device->vk.vkUpdateDescriptorSets(run->device->handle, write_count, writes, 0, NULL);
    return true;
}

static bool bind_descriptors(struct vkb_run *run, const struct binding *binding,
                             struct vkb_error *error)
{
    const struct vkb_pass_row *pass = binding->pass;
    const struct VolkDeviceTable *vk = &run->device->vk;
    const struct vkb_pass_layouts *layouts =
        vkb_bindings_layouts(&run->frame->pipelines.bindings, pass);
    VkDescriptorSet set;

    if (!vkb_descriptors_allocate(run->device, &run->submission->descriptors, layouts->made.set,
                                  &set, error)
        || !write_descriptors(run, binding, layouts, set, error))
        return false;
    vk->vkCmdBindDescriptorSets(run->submission->commands.buffer, vkb_pass_bind_point(pass),
                                layouts->made.pipeline, 0, 1, &set, 0, NULL);
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

// Draws each surface with its textures.
static bool draw_surfaces(struct vkb_run *run, const struct vkb_pass_row *pass,
                          const struct vkb_mesh *mesh, VkDeviceSize params, struct vkb_error *error)
{
    uint32_t first = mesh->plain_count;

    bind_mesh(run, mesh, true);
    for (uint32_t i = 0; i < mesh->surface_count; ++i) {
        const struct vkb_surface *surface = &mesh->surfaces[i];
        const struct binding binding = {.pass = pass, .params = params, .surface = surface};
        if (!bind_descriptors(run, &binding, error))
            return false;
        run->device->vk.vkCmdDrawIndexed(run->submission->commands.buffer, surface->index_count, 1,
                                         first, 0, 0);
        first += surface->index_count;
    }
    return true;
}

// Dispatches the workgroups for `rows` rows of the target.
static void dispatch(const struct vkb_run *run, const struct vkb_pass_row *pass, uint32_t rows)
{
    const struct vkb_image_row *target = &run->graph->images[pass->targets[0]];
    const uint32_t width = (target->width + pass->block_width - 1) / pass->block_width;
    const uint32_t height = (rows + pass->block_height - 1) / pass->block_height;

    run->device->vk.vkCmdDispatch(run->submission->commands.buffer,
                                  pass->groups_width ? pass->groups_width : width,
                                  pass->groups_height ? pass->groups_height : height,
                                  run->graph->layers ? run->graph->layers : 1);
}

// The most rows that one storage buffer descriptor can cover. They are a multiple of the block's
// rows, and end at an offset at which the next buffer can begin.
static uint32_t band_rows(const struct vkb_device *device, const struct vkb_pass_row *pass,
                          size_t row_pitch)
{
    const VkDeviceSize align = device->limits.minStorageBufferOffsetAlignment;
    const size_t aligned = align > VKB_WORD_SIZE ? (size_t)align / VKB_WORD_SIZE : 1;
    size_t block = pass->block_height;

    while (block % aligned != 0)
        block += pass->block_height;
    const size_t blocks = device->limits.maxStorageBufferRange / row_pitch / block;

    return (uint32_t)((blocks ? blocks : 1) * block);
}

// The output whose memory the pass can store to instead of its image; NULL: none. No other pass may
// read the image. An output without alpha needs a shader that stores three channels. If the request
// comes again, the pass stores to the image, so that a third time nothing has to run.
static struct vkb_output *find_stored(const struct vkb_run *run, const struct vkb_pass_row *pass)
{
    const struct vkb_plan *plan = run->request->plan;
    const uint32_t image = pass->targets[0];

    if (run->contents[image]->repeated || vkb_graph_history(run->graph, image) != VKB_NO_IMAGE)
        return NULL;
    for (uint32_t i = 0; i < run->graph->pass_count; ++i)
        if (run->frame->planner.needed[i] && vkb_pass_reads(&run->graph->passes[i], image))
            return NULL;
    for (uint32_t i = 0; i < plan->output_count; ++i) {
        struct vkb_output *output = &run->request->outputs[i];
        if (plan->outputs[i] == image && (vkb_readback_is_complete(output) || pass->shader->packed)
            && vkb_readback_takes_linear_texels(run->device, output))
            return output;
    }
    return NULL;
}

static void describe_linear_texels(const struct vkb_image *image, size_t row_pitch,
                                   int32_t shape[4])
{
    shape[0] = (int32_t)image->width;
    shape[1] = (int32_t)image->height;
    shape[2] = (int32_t)(row_pitch / VKB_WORD_SIZE);
    shape[3] = 0;
}

static void push_linear_texels(const struct vkb_run *run, const struct vkb_pass_row *pass,
                               const struct band *band)
{
    struct vkb_linear_texels shapes = {0};

    describe_linear_texels(&run->images[pass->targets[0]]->image, band->row_pitch, shapes.target);
    shapes.target[3] = (int32_t)band->first;
    for (uint32_t i = 0; i < pass->read_count; ++i) {
        const struct vkb_image *image = &run->images[vkb_pass_bound_image(pass, i)]->image;
        describe_linear_texels(image, image->row_pitch, shapes.reads[i]);
    }
    run->device->vk.vkCmdPushConstants(
        run->submission->commands.buffer,
        vkb_bindings_layouts(&run->frame->pipelines.bindings, pass)->made.pipeline,
        VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof shapes, &shapes);
}

// `output`: what the pass stores to; NULL: its image.
static bool dispatch_linear_texels(struct vkb_run *run, const struct vkb_pass_row *pass,
                                   VkDeviceSize params, struct vkb_output *output,
                                   struct vkb_error *error)
{
    const struct vkb_image *image = &run->images[pass->targets[0]]->image;
    const size_t channel_size = vkb_formats[image->format].channel_size;
    const VkDeviceSize start = output ? output->imported_offset : 0;
    struct band band = {
        .buffer.buffer = output ? output->imported : image->buffer,
        .row_pitch = output ? image->width * output->channels * channel_size : image->row_pitch,
    };
    const struct binding binding = {.pass = pass, .params = params, .band = &band};
    const uint32_t rows = band_rows(run->device, pass, band.row_pitch);

    if (output)
        output->sink = VKB_SINK_STORED;
    for (; band.first < image->height; band.first += rows) {
        const uint32_t left = image->height - band.first;
        band.rows = rows < left ? rows : left;
        band.buffer.offset = start + band.first * band.row_pitch;
        band.buffer.range = band.rows * band.row_pitch;
        if (!bind_descriptors(run, &binding, error))
            return false;
        push_linear_texels(run, pass, &band);
        dispatch(run, pass, band.rows);
    }
    return true;
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
    if (!bind_descriptors(run, &(struct binding){.pass = pass, .params = params}, error))
        return false;
    if (pass->geometry == VKB_GEOMETRY_DISPATCH) {
        dispatch(run, pass, run->graph->images[pass->targets[0]].height);
    } else if (!vkb_is_mesh(pass->geometry)) {
        vk->vkCmdDraw(commands, pass->vertices ? pass->vertices : 3, 1, 0, 0);
    } else if (mesh->plain_count > 0) {
        bind_mesh(run, mesh, false);
        vk->vkCmdDrawIndexed(commands, mesh->plain_count, 1, 0, 0, 0);
    }
    return true;
}

// Whether the pass gains from a source without NaN and infinity, and this one has none.
static bool reads_finite(const struct vkb_run *run, const struct vkb_pass_row *pass)
{
    const struct vkb_non_finite *non_finite = &run->frame->non_finite;

    return pass->gains_if_finite && !run->unknown_non_finite && non_finite->nan == 0
        && non_finite->inf == 0;
}

// Whether a fused pass keeps 8-bit levels, and the device reads them as products.
static bool keeps_levels(const struct vkb_run *run, const struct vkb_pass_row *pass)
{
    return pass->fused && pass->constants.format == STORED_UNORM8
        && run->device->texels == VKB_TEXELS_SCALED;
}

// The row of a pass as it runs: its shader and constants depend on the source, and on where the
// result goes. *output: where a dispatch stores it; NULL: in an image.
static struct vkb_pass_row make_row(const struct vkb_run *run, uint32_t index,
                                    struct vkb_output **output)
{
    struct vkb_pass_row row = run->graph->passes[index];
    const bool linear = row.reading == VKB_READING_LINEAR_TEXELS;

    *output = linear ? find_stored(run, &row) : NULL;
    if (linear && run->images[vkb_pass_bound_image(&row, SLOT_SOURCE)]->image.channels == 3)
        row.shader = row.shader->rgb;
    if (*output && !vkb_readback_is_complete(*output))
        row.shader = row.shader->packed;
    row.constants.finite = reads_finite(run, &row);
    if (keeps_levels(run, &row))
        row.constants.format = STORED_UNORM8_SCALED;
    return row;
}

static bool record_pass(struct vkb_run *run, uint32_t index, struct vkb_error *error)
{
    struct vkb_output *output;
    const struct vkb_pass_row row = make_row(run, index, &output), *pass = &row;
    VkCommandBuffer commands = run->submission->commands.buffer;
    VkPipeline pipeline;

    if (!vkb_pipelines_get(run->device, &run->frame->pipelines, run->graph, pass, &pipeline, error))
        return false;
    vkb_label_begin(run->device, commands, vkb_graph_label(run->graph, pass->name));
    run->device->vk.vkCmdBindPipeline(commands, vkb_pass_bind_point(pass), pipeline);
    const bool done = pass->reading == VKB_READING_LINEAR_TEXELS
                        ? dispatch_linear_texels(run, pass, write_params(run, pass), output, error)
                        : draw(run, pass, write_params(run, pass), error);
    vkb_label_end(run->device, commands);
    return done;
}

void vkb_record_pipelines(struct vkb_run *run)
{
    const struct vkb_planner *planner = &run->frame->planner;
    const uint32_t count = run->graph->pass_count;
    struct vkb_error error;
    struct vkb_pass_row *rows = vkb_alloc(&error, count, sizeof *rows);
    uint32_t running = 0;

    for (uint32_t i = 0; rows && i < count; ++i)
        if (planner->needed[i] && !planner->current[i] && !run->graph->passes[i].host) {
            struct vkb_output *output;
            rows[running++] = make_row(run, i, &output);
        }
    if (rows)
        vkb_pipelines_create_together(run->device, &run->frame->pipelines, run->graph, rows,
                                      running);
    vkb_free(rows);
}

static void transition_reads(struct vkb_run *run, uint32_t first, uint32_t end)
{
    for (uint32_t i = first; i < end; ++i) {
        const struct vkb_pass_row *pass = &run->graph->passes[i];
        for (uint32_t read = 0; read < pass->read_count; ++read) {
            if (vkb_pass_needs(pass, read))
                vkb_image_transition(run->device, run->submission->commands.buffer,
                                     &run->images[pass->reads[read]]->image,
                                     vkb_pass_reads_as(pass));
        }
    }
}

// Transitions the image and describes it as an attachment.
static VkRenderingAttachmentInfo attach(struct vkb_run *run, uint32_t index, enum vkb_access access,
                                        enum vkb_load load)
{
    struct vkb_image *image = &run->images[index]->image;
    const bool depth = access == VKB_ACCESS_DEPTH_TARGET;

    vkb_image_transition(run->device, run->submission->commands.buffer, image, access);
    return (VkRenderingAttachmentInfo){
        .sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO,
        .imageView = image->view,
        .imageLayout = vkb_image_layout(image, access),
        .loadOp =
            load == VKB_LOAD_CLEAR ? VK_ATTACHMENT_LOAD_OP_CLEAR : VK_ATTACHMENT_LOAD_OP_DONT_CARE,
        // Depth is stored, since it is a framebuffer. (The forward system's source discards it.)
        .storeOp = VK_ATTACHMENT_STORE_OP_STORE,
        .clearValue = depth ? (VkClearValue){.depthStencil = {.depth = 1.0f}}
                            : (VkClearValue){.color = {.float32 = {0.0f, 0.0f, 0.0f, 1.0f}}},
    };
}

static void begin_rendering(struct vkb_run *run, const struct vkb_pass_row *pass)
{
    const struct VolkDeviceTable *vk = &run->device->vk;
    const VkCommandBuffer commands = run->submission->commands.buffer;
    const struct vkb_image_row *target =
        &run->graph->images[pass->target_count ? pass->targets[0] : pass->depth];
    const VkRect2D area = {.extent = {target->width, target->height}};
    VkRenderingAttachmentInfo colours[VKB_MAX_TARGETS], depth;

    for (uint32_t i = 0; i < pass->target_count; ++i)
        colours[i] = attach(run, pass->targets[i], VKB_ACCESS_COLOR_TARGET, pass->load);
    if (pass->depth != VKB_NO_IMAGE)
        depth = attach(run, pass->depth, VKB_ACCESS_DEPTH_TARGET, VKB_LOAD_CLEAR);
    vk->vkCmdBeginRendering(commands,
                            &(VkRenderingInfo){
                                .sType = VK_STRUCTURE_TYPE_RENDERING_INFO,
                                .renderArea = area,
                                .layerCount = 1,
                                .colorAttachmentCount = pass->target_count,
                                .pColorAttachments = colours,
                                .pDepthAttachment = pass->depth != VKB_NO_IMAGE ? &depth : NULL,
                            });
    vk->vkCmdSetViewport(commands, 0, 1,
                         &(VkViewport){
                             .width = (float)target->width,
                             .height = (float)target->height,
                             .maxDepth = 1.0f,
                         });
    vk->vkCmdSetScissor(commands, 0, 1, &area);
}

// The image's pixels; none where a pass reads or writes no image.
static struct vkb_host_image host_image(const struct vkb_run *run, uint32_t index)
{
    if (index == VKB_NO_IMAGE)
        return (struct vkb_host_image){0};
    const struct vkb_image *image = &run->images[index]->image;
    return (struct vkb_host_image){
        .pixels = image->mapped,
        .pitch = image->row_pitch / sizeof(float),
        .width = image->width,
        .height = image->height,
    };
}

// Submits what is recorded, waits for it and for all submissions before it, and runs the pass. Its
// time is from the end of one submission to the start of the next.
static bool run_on_host(struct vkb_run *run, const struct vkb_pass_row *pass,
                        struct vkb_error *error)
{
    struct vkb_device *device = run->device;
    struct vkb_submission *submission = run->submission;
    struct vkb_host_image reads[VKB_MAX_READS], target = host_image(run, pass->targets[0]);

    for (uint32_t slot = 0; slot < VKB_MAX_READS; ++slot)
        reads[slot] = host_image(run, slot < pass->read_count ? pass->reads[slot] : VKB_NO_IMAGE);
    vkb_barrier_record(device, submission->commands.buffer, NULL, true, VKB_ACCESS_RESOURCE,
                       VKB_ACCESS_HOST_READ);
    return vkb_buffer_flush(device, &submission->uniforms, error)
        && vkb_submission_submit(device, submission, NULL, error)
        && vkb_submission_wait(device, &run->frame->submissions, submission, error)
        && pass->host(pass, reads, &target, device->workers, error)
        && vkb_commands_begin(device, &submission->commands, error);
}

// Records passes first..end-1, a dispatch or those of a render pass, with one timing. Within a
// render pass, tiling devices and lavapipe do not keep the order of draws, so single draws cannot
// be timed.
static bool record_passes(struct vkb_run *run, uint32_t first, uint32_t end,
                          struct vkb_error *error)
{
    struct vkb_device *device = run->device;
    struct vkb_timer *timer = &run->submission->timer;
    const struct vkb_pass_row *pass = &run->graph->passes[first];
    const bool draws = pass->geometry != VKB_GEOMETRY_DISPATCH;
    const VkCommandBuffer commands = run->submission->commands.buffer;
    struct vkb_timing *timing = &run->request->timings[run->request->timing_count++];

    // The time of a pass starts at the end of the one before it. It contains the barriers, since
    // lavapipe takes a timestamp at the next one.
    if (run->request->timing_count == 1)
        vkb_timer_stamp(device, commands, timer);
    transition_reads(run, first, end);
    if (draws)
        begin_rendering(run, pass);
    for (uint32_t i = 0; !draws && i < pass->target_count; ++i)
        vkb_image_transition(device, commands, &run->images[pass->targets[i]]->image,
                             vkb_pass_in_place(pass) ? VKB_ACCESS_DISPATCH_CHANGED
                                                     : VKB_ACCESS_DISPATCH_STORED);
    for (uint32_t i = first; i < end; ++i)
        if (!(pass->host ? run_on_host(run, pass, error) : record_pass(run, i, error)))
            return false;
    if (draws)
        device->vk.vkCmdEndRendering(commands);
    vkb_timer_stamp(device, commands, timer);
    vkb_set_name(timing->name, sizeof timing->name, vkb_graph_timed_as(run->graph, first));
    return true;
}

// Loads the resources of a pass. If passes change them, this one waits for all before it.
static bool load_resources(struct vkb_run *run, const struct vkb_pass_row *pass,
                           struct vkb_error *error)
{
    VkCommandBuffer commands = run->submission->commands.buffer;

    if (!vkb_resources_load(run->device, commands, run->submission->number, pass,
                            &run->frame->resources, error))
        return false;
    if (pass->turn)
        vkb_barrier_record(run->device, commands, NULL, true, VKB_ACCESS_RESOURCE,
                           VKB_ACCESS_RESOURCE);
    return true;
}

bool vkb_record_group(void *context, uint32_t first, uint32_t end, struct vkb_error *error)
{
    struct vkb_run *run = context;

    if (run->shares && !vkb_share_targets(run, first, error))
        return false;
    for (uint32_t i = first; i < end; ++i)
        if (!load_resources(run, &run->graph->passes[i], error))
            return false;
    if (run->graph->passes[first].geometry != VKB_GEOMETRY_DISPATCH)
        return record_passes(run, first, end, error);
    for (uint32_t i = first; i < end; ++i)
        if (!record_passes(run, i, i + 1, error))
            return false;
    return true;
}
