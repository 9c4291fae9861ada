#include "run/bindings.h"

static bool create_sampler(const struct vkb_device *device, VkFilter filter, VkSampler *sampler,
                           struct vkb_error *error)
{
    return VK(error,
              device->vk.vkCreateSampler(device->handle,
                                         &(VkSamplerCreateInfo){
                                             .sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO,
                                             .magFilter = filter,
                                             .minFilter = filter,
                                             .mipmapMode = filter == VK_FILTER_LINEAR
                                                             ? VK_SAMPLER_MIPMAP_MODE_LINEAR
                                                             : VK_SAMPLER_MIPMAP_MODE_NEAREST,
                                             .addressModeU = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE,
                                             .addressModeV = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE,
                                             .addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE,
                                             .maxLod = VK_LOD_CLAMP_NONE,
                                         },
                                         NULL, sampler));
}

static const struct binding_kind {
    struct vkb_binding_types types;
    uint32_t most_reads;
} binding_kinds[VKB_BINDING_KINDS] = {
    [VKB_BINDINGS_DRAW] = {{.read = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER}, VKB_MAX_READS},
    [VKB_BINDINGS_DISPATCH] = {{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
                                VK_DESCRIPTOR_TYPE_STORAGE_IMAGE},
                               VKB_MAX_READS},
    [VKB_BINDINGS_LOAD] = {{VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE},
                           VKB_MAX_LOADS},
    [VKB_BINDINGS_WORDS] = {{VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER,
                             VK_DESCRIPTOR_TYPE_STORAGE_BUFFER},
                            VKB_MAX_WORDS},
};

static bool create_layouts(const struct vkb_device *device, struct vkb_bindings *bindings,
                           enum vkb_binding_kind kind, uint32_t images, struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;
    const struct vkb_binding_types types = binding_kinds[kind].types;
    const bool draw = kind == VKB_BINDINGS_DRAW;
    const VkShaderStageFlags stages =
        draw ? VK_SHADER_STAGE_FRAGMENT_BIT : VK_SHADER_STAGE_COMPUTE_BIT;
    VkDescriptorSetLayoutBinding rows[VKB_MAX_READS + 2] = {
        {
            .binding = 0,
            .descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER,
            .descriptorCount = 1,
            .stageFlags = stages | (draw ? VK_SHADER_STAGE_VERTEX_BIT : 0),
        },
    };
    const uint32_t count = 1 + images + !draw;

    for (uint32_t i = 1; i < count; ++i)
        rows[i] = (VkDescriptorSetLayoutBinding){
            .binding = i,
            .descriptorType = i <= images ? types.read : types.target,
            .descriptorCount = 1,
            .stageFlags = stages,
        };
    return VK(error, vk->vkCreateDescriptorSetLayout(
                         device->handle,
                         &(VkDescriptorSetLayoutCreateInfo){
                             .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                             .bindingCount = count,
                             .pBindings = rows,
                         },
                         NULL, &bindings->set_layouts[kind][images]))
        && VK(error,
              vk->vkCreatePipelineLayout(device->handle,
                                         &(VkPipelineLayoutCreateInfo){
                                             .sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
                                             .setLayoutCount = 1,
                                             .pSetLayouts = &bindings->set_layouts[kind][images],
                                             .pushConstantRangeCount = kind == VKB_BINDINGS_WORDS,
                                             .pPushConstantRanges =
                                                 &(VkPushConstantRange){
                                                     .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT,
                                                     .size = sizeof(struct vkb_words),
                                                 },
                                         },
                                         NULL, &bindings->layouts[kind][images]));
}

bool vkb_bindings_create(const struct vkb_device *device, struct vkb_bindings *bindings,
                         struct vkb_error *error)
{
    *bindings = (struct vkb_bindings){0};
    bool done = true;

    for (int kind = 0; kind < VKB_BINDING_KINDS; ++kind)
        for (uint32_t images = 0; done && images <= binding_kinds[kind].most_reads; ++images)
            done = create_layouts(device, bindings, (enum vkb_binding_kind)kind, images, error);
    if (!done)
        vkb_bindings_destroy(device, bindings);
    return done;
}

void vkb_bindings_destroy(const struct vkb_device *device, struct vkb_bindings *bindings)
{
    const struct VolkDeviceTable *vk = &device->vk;

    for (int kind = 0; kind < VKB_BINDING_KINDS; ++kind)
        for (uint32_t i = 0; i <= VKB_MAX_READS; ++i) {
            vk->vkDestroyPipelineLayout(device->handle, bindings->layouts[kind][i], NULL);
            vk->vkDestroyDescriptorSetLayout(device->handle, bindings->set_layouts[kind][i], NULL);
        }
    vk->vkDestroySampler(device->handle, bindings->filter, NULL);
    vk->vkDestroySampler(device->handle, bindings->nearest, NULL);
    *bindings = (struct vkb_bindings){0};
}

bool vkb_bindings_sampler(const struct vkb_device *device, struct vkb_bindings *bindings,
                          enum vkb_format format, VkSampler *sampler, struct vkb_error *error)
{
    const bool filters =
        vkb_device_supports(device, format, VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT);
    VkSampler *kept = filters ? &bindings->filter : &bindings->nearest;

    if (!*kept
        && !create_sampler(device, filters ? VK_FILTER_LINEAR : VK_FILTER_NEAREST, kept, error))
        return false;
    *sampler = *kept;
    return true;
}

uint32_t vkb_pass_descriptor_images(const struct vkb_pass_row *pass)
{
    return pass->textured ? 2 : pass->geometry == VKB_GEOMETRY_SKYBOX ? 1 : pass->read_count;
}

static enum vkb_binding_kind kind_of(const struct vkb_pass_row *pass)
{
    if (pass->geometry != VKB_GEOMETRY_DISPATCH)
        return VKB_BINDINGS_DRAW;
    return pass->reading == VKB_READING_SAMPLED ? VKB_BINDINGS_DISPATCH
         : pass->reading == VKB_READING_LOADED  ? VKB_BINDINGS_LOAD
                                                : VKB_BINDINGS_WORDS;
}

struct vkb_binding_types vkb_pass_binding_types(const struct vkb_pass_row *pass)
{
    return binding_kinds[kind_of(pass)].types;
}

VkPipelineBindPoint vkb_pass_bind_point(const struct vkb_pass_row *pass)
{
    return pass->geometry == VKB_GEOMETRY_DISPATCH ? VK_PIPELINE_BIND_POINT_COMPUTE
                                                   : VK_PIPELINE_BIND_POINT_GRAPHICS;
}

VkDescriptorSetLayout vkb_bindings_set_layout(const struct vkb_bindings *bindings,
                                              const struct vkb_pass_row *pass)
{
    return bindings->set_layouts[kind_of(pass)][vkb_pass_descriptor_images(pass)];
}

VkPipelineLayout vkb_bindings_layout(const struct vkb_bindings *bindings,
                                     const struct vkb_pass_row *pass)
{
    return bindings->layouts[kind_of(pass)][vkb_pass_descriptor_images(pass)];
}
