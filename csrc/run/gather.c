#include "run/gather.h"

#include "spirv.h"

enum {
    BUFFERS = 3,
    GROUP_SIZE = 128,      // of gather.comp
    MOST_GROUPS = 0xffff,  // along x, which every device can do
};

static bool create_layouts(const struct vkb_device *device, struct vkb_gather *gather,
                           struct vkb_error *error)
{
    VkDescriptorSetLayoutBinding bindings[BUFFERS];

    for (uint32_t i = 0; i < BUFFERS; ++i)
        bindings[i] = (VkDescriptorSetLayoutBinding){
            .binding = i,
            .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
            .descriptorCount = 1,
            .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT,
        };
    return VK(error, device->vk.vkCreateDescriptorSetLayout(
                         device->handle,
                         &(VkDescriptorSetLayoutCreateInfo){
                             .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                             .bindingCount = BUFFERS,
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
                            struct vkb_gather *gather, struct vkb_error *error)
{
    const struct vkb_shader *shader = &vkb_shader_gather_comp;
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
                      NULL, &gather->pipeline));
    device->vk.vkDestroyShaderModule(device->handle, module, NULL);
    return done;
}

bool vkb_gather_create(const struct vkb_device *device, VkPipelineCache cache,
                       struct vkb_gather *gather, struct vkb_error *error)
{
    if (gather->pipeline)
        return true;
    vkb_gather_destroy(device, gather);
    return create_layouts(device, gather, error) && create_pipeline(device, cache, gather, error);
}

void vkb_gather_destroy(const struct vkb_device *device, struct vkb_gather *gather)
{
    device->vk.vkDestroyPipeline(device->handle, gather->pipeline, NULL);
    device->vk.vkDestroyPipelineLayout(device->handle, gather->layout, NULL);
    device->vk.vkDestroyDescriptorSetLayout(device->handle, gather->sets, NULL);
    *gather = (struct vkb_gather){0};
}

static void write_set(const struct vkb_device *device, VkDescriptorSet set,
                      const struct vkb_gather_work *work)
{
    const VkDescriptorBufferInfo *buffers[BUFFERS] = {&work->from, &work->to, &work->counts};
    VkWriteDescriptorSet writes[BUFFERS];

    for (uint32_t i = 0; i < BUFFERS; ++i)
        writes[i] = (VkWriteDescriptorSet){
            .sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
            .dstSet = set,
            .dstBinding = i,
            .descriptorCount = 1,
            .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
            .pBufferInfo = buffers[i],
        };
    device->vk.vkUpdateDescriptorSets(device->handle, BUFFERS, writes, 0, NULL);
}

bool vkb_gather_record(const struct vkb_device *device, const struct vkb_gather *gather,
                       VkCommandBuffer commands, VkDescriptorPool pool,
                       const struct vkb_gather_work *work, struct vkb_error *error)
{
    const struct vkb_gather_layout *layout = &work->layout;
    const struct VolkDeviceTable *vk = &device->vk;
    const uint32_t per_group = GROUP_SIZE * 4 / layout->size;
    const uint64_t count = (uint64_t)layout->width * layout->height * layout->channels;
    const uint32_t groups = (uint32_t)((count + per_group - 1) / per_group);
    const uint32_t rows = (groups + MOST_GROUPS - 1) / MOST_GROUPS;
    VkDescriptorSet set;

    if (!VK(error, vk->vkAllocateDescriptorSets(
                       device->handle,
                       &(VkDescriptorSetAllocateInfo){
                           .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                           .descriptorPool = pool,
                           .descriptorSetCount = 1,
                           .pSetLayouts = &gather->sets,
                       },
                       &set)))
        return false;
    write_set(device, set, work);
    vk->vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, gather->pipeline);
    vk->vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, gather->layout, 0, 1,
                                &set, 0, NULL);
    vk->vkCmdPushConstants(commands, gather->layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof *layout,
                           layout);
    vk->vkCmdDispatch(commands, (groups + rows - 1) / rows, rows, 1);
    return true;
}
