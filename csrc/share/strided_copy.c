#include "share/strided_copy.h"
#include "execute/pipeline.h"

#include "spirv.h"

enum {
    BINDINGS = 3,
    GROUP_SIZE = 128,  // of strided_copy.glsl
    TILE_WIDTH = 16,   // of the pixels of a group that writes to an image
    TILE_PIXELS = 4,   // of an invocation, in a column of the tile
    TILE_HEIGHT = TILE_PIXELS * GROUP_SIZE / TILE_WIDTH,
    MAX_GROUPS = 0xffff,  // along x, which every device can do
};

#define BUFFER VK_DESCRIPTOR_TYPE_STORAGE_BUFFER

static const struct kind {
    const struct vkb_shader *shader;
    VkDescriptorType types[BINDINGS];
} kinds[VKB_STRIDED_COPY_COUNT] = {
    [VKB_STRIDED_COPY_TO_IMAGE] = {&vkb_shader_strided_copy_to_image_comp,
                                   {BUFFER, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, BUFFER}},
    [VKB_STRIDED_COPY_FROM_IMAGE] = {&vkb_shader_strided_copy_from_image_comp,
                                     {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, BUFFER, BUFFER}},
    [VKB_STRIDED_COPY_TO_LAYERS] = {&vkb_shader_strided_copy_to_image_comp_layers,
                                    {BUFFER, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, BUFFER}},
    [VKB_STRIDED_COPY_FROM_LAYERS] = {&vkb_shader_strided_copy_from_image_comp_layers,
                                      {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, BUFFER, BUFFER}},
    [VKB_FETCH_TEXELS] = {&vkb_shader_fetch_texels_comp,
                          {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, BUFFER, BUFFER}},
};

static bool create_layouts(const struct vkb_device *device, const struct kind *kind,
                           struct vkb_strided_copy_pipeline *copies, struct vkb_error *error)
{
    VkDescriptorSetLayoutBinding bindings[BINDINGS];

    for (uint32_t i = 0; i < BINDINGS; ++i)
        bindings[i] = (VkDescriptorSetLayoutBinding){
            .binding = i,
            .descriptorType = kind->types[i],
            .descriptorCount = 1,
            .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT,
        };
    return vkb_layouts_create(device, bindings, BINDINGS, sizeof(struct vkb_strided_copy_layout),
                              &copies->layouts, error);
}

static void destroy(const struct vkb_device *device, struct vkb_strided_copy_pipeline *pipeline)
{
    device->vk.vkDestroyPipeline(device->handle, pipeline->handle, NULL);
    vkb_layouts_destroy(device, &pipeline->layouts);
    *pipeline = (struct vkb_strided_copy_pipeline){0};
}

bool vkb_strided_copy_create(const struct vkb_device *device, VkPipelineCache cache,
                             enum vkb_strided_copy_kind kind, struct vkb_strided_copies *copies,
                             struct vkb_error *error)
{
    struct vkb_strided_copy_pipeline *pipeline = &copies->pipelines[kind];

    if (pipeline->handle)
        return true;
    destroy(device, pipeline);
    return create_layouts(device, &kinds[kind], pipeline, error)
        && vkb_compute_create(device, cache, kinds[kind].shader, &(struct vkb_constants){0},
                              pipeline->layouts.pipeline, &pipeline->handle, error);
}

void vkb_strided_copy_destroy(const struct vkb_device *device, struct vkb_strided_copies *copies)
{
    for (int kind = 0; kind < VKB_STRIDED_COPY_COUNT; ++kind)
        destroy(device, &copies->pipelines[kind]);
}

static void write_set(const struct vkb_device *device, VkDescriptorSet set,
                      const struct vkb_strided_copy_work *work)
{
    const VkDescriptorBufferInfo *buffers[BINDINGS] = {&work->from, &work->to, &work->counts};
    VkWriteDescriptorSet writes[BINDINGS];

    for (uint32_t i = 0; i < BINDINGS; ++i)
        writes[i] = (VkWriteDescriptorSet){
            .sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
            .dstSet = set,
            .dstBinding = i,
            .descriptorCount = 1,
            .descriptorType = kinds[work->kind].types[i],
            .pBufferInfo = buffers[i],
            .pImageInfo = &work->image,
        };
    device->vk.vkUpdateDescriptorSets(device->handle, BINDINGS, writes, 0, NULL);
}

static VkExtent2D count_groups(const struct vkb_strided_copy_work *work)
{
    const struct vkb_strided_copy_layout *layout = &work->layout;

    if (work->kind == VKB_STRIDED_COPY_TO_IMAGE || work->kind == VKB_STRIDED_COPY_TO_LAYERS)
        return (VkExtent2D){
            (layout->width + TILE_WIDTH - 1) / TILE_WIDTH,
            (layout->height + TILE_HEIGHT - 1) / TILE_HEIGHT,
        };
    const uint64_t count = (uint64_t)layout->width * layout->height;
    const uint32_t per_group = GROUP_SIZE * (16 / layout->size);
    const uint32_t groups = (uint32_t)((count + per_group - 1) / per_group);
    const uint32_t rows = (groups + MAX_GROUPS - 1) / MAX_GROUPS;
    return (VkExtent2D){(groups + rows - 1) / rows, rows};
}

bool vkb_strided_copy_record(const struct vkb_device *device,
                             const struct vkb_strided_copies *copies, VkCommandBuffer commands,
                             struct vkb_descriptors *descriptors,
                             const struct vkb_strided_copy_work *work, struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;
    const struct vkb_strided_copy_pipeline *pipeline = &copies->pipelines[work->kind];
    const VkExtent2D groups = count_groups(work);
    VkDescriptorSet set;

    if (!vkb_descriptors_allocate(device, descriptors, pipeline->layouts.set, &set, error))
        return false;
    write_set(device, set, work);
    vk->vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline->handle);
    vk->vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE,
                                pipeline->layouts.pipeline, 0, 1, &set, 0, NULL);
    vk->vkCmdPushConstants(commands, pipeline->layouts.pipeline, VK_SHADER_STAGE_COMPUTE_BIT, 0,
                           sizeof work->layout, &work->layout);
    vk->vkCmdDispatch(commands, groups.width, groups.height, work->layers ? work->layers : 1);
    return true;
}
