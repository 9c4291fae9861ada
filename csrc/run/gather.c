#include "run/gather.h"

#include "spirv.h"

enum {
    BINDINGS = 3,
    GROUP_SIZE = 128,  // of gather.glsl
    TILE_WIDTH = 16,   // of the pixels of a group, if it writes to an image
    TILE_HEIGHT = GROUP_SIZE / TILE_WIDTH,
    MAX_GROUPS = 0xffff,  // along x, which every device can do
};

#define BUFFER VK_DESCRIPTOR_TYPE_STORAGE_BUFFER

static const struct kind {
    const struct vkb_shader *shader;
    VkDescriptorType types[BINDINGS];
} kinds[VKB_GATHER_COUNT] = {
    [VKB_GATHER_BUFFER] = {&vkb_shader_gather_buffer_comp, {BUFFER, BUFFER, BUFFER}},
    [VKB_GATHER_TO_IMAGE] = {&vkb_shader_gather_to_image_comp,
                             {BUFFER, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, BUFFER}},
    [VKB_GATHER_FROM_IMAGE] = {&vkb_shader_gather_from_image_comp,
                               {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, BUFFER, BUFFER}},
    [VKB_GATHER_TO_LAYERS] = {&vkb_shader_gather_to_image_comp_layers,
                              {BUFFER, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, BUFFER}},
    [VKB_GATHER_FROM_LAYERS] = {&vkb_shader_gather_from_image_comp_layers,
                                {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, BUFFER, BUFFER}},
};

static bool create_layouts(const struct vkb_device *device, const struct kind *kind,
                           struct vkb_gather_pipeline *gather, struct vkb_error *error)
{
    VkDescriptorSetLayoutBinding bindings[BINDINGS];

    for (uint32_t i = 0; i < BINDINGS; ++i)
        bindings[i] = (VkDescriptorSetLayoutBinding){
            .binding = i,
            .descriptorType = kind->types[i],
            .descriptorCount = 1,
            .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT,
        };
    return VK(error, device->vk.vkCreateDescriptorSetLayout(
                         device->handle,
                         &(VkDescriptorSetLayoutCreateInfo){
                             .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                             .bindingCount = BINDINGS,
                             .pBindings = bindings,
                         },
                         NULL, &gather->sets))
        && VK(error, device->vk.vkCreatePipelineLayout(
                         device->handle,
                         &(VkPipelineLayoutCreateInfo){
                             .sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
                             .setLayoutCount = 1,
                             .pSetLayouts = &gather->sets,
                             .pushConstantRangeCount = 1,
                             .pPushConstantRanges =
                                 &(VkPushConstantRange){
                                     .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT,
                                     .size = sizeof(struct vkb_gather_layout),
                                 },
                         },
                         NULL, &gather->layout));
}

static bool create_pipeline(const struct vkb_device *device, VkPipelineCache cache,
                            const struct vkb_shader *shader, struct vkb_gather_pipeline *gather,
                            struct vkb_error *error)
{
    VkShaderModule module;

    if (!VK(error, device->vk.vkCreateShaderModule(
                       device->handle,
                       &(VkShaderModuleCreateInfo){
                           .sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO,
                           .codeSize = shader->size,
                           .pCode = shader->code,
                       },
                       NULL, &module)))
        return false;
    const bool done =
        VK(error, device->vk.vkCreateComputePipelines(
                      device->handle, cache, 1,
                      &(VkComputePipelineCreateInfo){
                          .sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
                          .stage =
                              {
                                  .sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                                  .stage = VK_SHADER_STAGE_COMPUTE_BIT,
                                  .module = module,
                                  .pName = "main",
                              },
                          .layout = gather->layout,
                      },
                      NULL, &gather->handle));
    device->vk.vkDestroyShaderModule(device->handle, module, NULL);
    return done;
}

static void destroy(const struct vkb_device *device, struct vkb_gather_pipeline *pipeline)
{
    device->vk.vkDestroyPipeline(device->handle, pipeline->handle, NULL);
    device->vk.vkDestroyPipelineLayout(device->handle, pipeline->layout, NULL);
    device->vk.vkDestroyDescriptorSetLayout(device->handle, pipeline->sets, NULL);
    *pipeline = (struct vkb_gather_pipeline){0};
}

bool vkb_gather_create(const struct vkb_device *device, VkPipelineCache cache,
                       enum vkb_gather_kind kind, struct vkb_gather *gather,
                       struct vkb_error *error)
{
    struct vkb_gather_pipeline *pipeline = &gather->pipelines[kind];

    if (pipeline->handle)
        return true;
    destroy(device, pipeline);
    return create_layouts(device, &kinds[kind], pipeline, error)
        && create_pipeline(device, cache, kinds[kind].shader, pipeline, error);
}

void vkb_gather_destroy(const struct vkb_device *device, struct vkb_gather *gather)
{
    for (int kind = 0; kind < VKB_GATHER_COUNT; ++kind)
        destroy(device, &gather->pipelines[kind]);
}

static void write_set(const struct vkb_device *device, VkDescriptorSet set,
                      const struct vkb_gather_work *work)
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

static VkExtent2D count_groups(const struct vkb_gather_work *work)
{
    const struct vkb_gather_layout *layout = &work->layout;

    if (work->kind == VKB_GATHER_TO_IMAGE || work->kind == VKB_GATHER_TO_LAYERS)
        return (VkExtent2D){
            (layout->width + TILE_WIDTH - 1) / TILE_WIDTH,
            (layout->height + TILE_HEIGHT - 1) / TILE_HEIGHT,
        };
    const uint64_t count = (uint64_t)layout->width * layout->height * layout->channels;
    const uint32_t per_group = GROUP_SIZE * (16 / layout->size);
    const uint32_t groups = (uint32_t)((count + per_group - 1) / per_group);
    const uint32_t rows = (groups + MAX_GROUPS - 1) / MAX_GROUPS;
    return (VkExtent2D){(groups + rows - 1) / rows, rows};
}

bool vkb_gather_record(const struct vkb_device *device, const struct vkb_gather *gather,
                       VkCommandBuffer commands, VkDescriptorPool pool,
                       const struct vkb_gather_work *work, struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;
    const struct vkb_gather_pipeline *pipeline = &gather->pipelines[work->kind];
    const VkExtent2D groups = count_groups(work);
    VkDescriptorSet set;

    if (!VK(error, vk->vkAllocateDescriptorSets(
                       device->handle,
                       &(VkDescriptorSetAllocateInfo){
                           .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                           .descriptorPool = pool,
                           .descriptorSetCount = 1,
                           .pSetLayouts = &pipeline->sets,
                       },
                       &set)))
        return false;
    write_set(device, set, work);
    vk->vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline->handle);
    vk->vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline->layout, 0, 1,
                                &set, 0, NULL);
    vk->vkCmdPushConstants(commands, pipeline->layout, VK_SHADER_STAGE_COMPUTE_BIT, 0,
                           sizeof work->layout, &work->layout);
    vk->vkCmdDispatch(commands, groups.width, groups.height, work->layers ? work->layers : 1);
    return true;
}
