#include "execute/bindings.h"

#include <string.h>

bool vkb_sampler_create(const struct vkb_device *device, VkFilter filter,
                        VkSamplerAddressMode border, VkSampler *sampler, struct vkb_error *error)
{
    return VK(error, device->vk.vkCreateSampler(device->handle,
                                                &(VkSamplerCreateInfo){
                                                    .sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO,
                                                    .magFilter = filter,
                                                    .minFilter = filter,
                                                    // The modes have the filters' values.
                                                    .mipmapMode = (VkSamplerMipmapMode)filter,
                                                    .addressModeU = border,
                                                    .addressModeV = border,
                                                    .addressModeW = border,
                                                    .maxLod = VK_LOD_CLAMP_NONE,
                                                },
                                                NULL, sampler));
}

bool vkb_layouts_create(const struct vkb_device *device,
                        const VkDescriptorSetLayoutBinding *bindings, uint32_t count,
                        uint32_t constants, struct vkb_layouts *layouts, struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;

    return VK(error, vk->vkCreateDescriptorSetLayout(
                         device->handle,
                         &(VkDescriptorSetLayoutCreateInfo){
                             .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                             .bindingCount = count,
                             .pBindings = bindings,
                         },
                         NULL, &layouts->set))
        && VK(error,
              vk->vkCreatePipelineLayout(device->handle,
                                         &(VkPipelineLayoutCreateInfo){
                                             .sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
                                             .setLayoutCount = 1,
                                             .pSetLayouts = &layouts->set,
                                             .pushConstantRangeCount = constants > 0,
                                             .pPushConstantRanges =
                                                 &(VkPushConstantRange){
                                                     .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT,
                                                     .size = constants,
                                                 },
                                         },
                                         NULL, &layouts->pipeline));
}

void vkb_layouts_destroy(const struct vkb_device *device, struct vkb_layouts *layouts)
{
    device->vk.vkDestroyPipelineLayout(device->handle, layouts->pipeline, NULL);
    device->vk.vkDestroyDescriptorSetLayout(device->handle, layouts->set, NULL);
    *layouts = (struct vkb_layouts){0};
}

static bool create_layouts(const struct vkb_device *device, struct vkb_pass_layouts *layouts,
                           struct vkb_error *error)
{
    const VkShaderStageFlags stages =
        layouts->draw ? VK_SHADER_STAGE_FRAGMENT_BIT : VK_SHADER_STAGE_COMPUTE_BIT;
    VkDescriptorSetLayoutBinding rows[VKB_MAX_DESCRIPTORS + 1] = {
        {
            .binding = 0,
            .descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER,
            .descriptorCount = 1,
            .stageFlags = stages | (layouts->draw ? VK_SHADER_STAGE_VERTEX_BIT : 0),
        },
    };

    for (uint32_t i = 0; i < layouts->count; ++i) {
        const uint32_t read = layouts->count - layouts->stored;
        const uint32_t number = i < read ? i + 1 : TARGET_BINDING + i - read;
        rows[i + 1] = (VkDescriptorSetLayoutBinding){
            .binding = number,
            .descriptorType = layouts->descriptors[number - 1],
            .descriptorCount = 1,
            .stageFlags = stages,
        };
    }
    const uint32_t constants =
        layouts->reading == VKB_READING_LINEAR_TEXELS ? sizeof(struct vkb_linear_texels) : 0;
    return vkb_layouts_create(device, rows, layouts->count + 1, constants, &layouts->made, error);
}

void vkb_bindings_destroy(const struct vkb_device *device, struct vkb_bindings *bindings)
{
    for (size_t i = 0; i < bindings->layout_count; ++i)
        vkb_layouts_destroy(device, &bindings->layouts[i].made);
    vkb_free(bindings->layouts);
    for (size_t i = 0; i < VKB_SAMPLINGS; ++i)
        device->vk.vkDestroySampler(device->handle, bindings->samplers[i], NULL);
    *bindings = (struct vkb_bindings){0};
}

bool vkb_bindings_sampler(const struct vkb_device *device, struct vkb_bindings *bindings,
                          enum vkb_format format, uint32_t sampling, VkSampler *sampler,
                          struct vkb_error *error)
{
    static const VkSamplerAddressMode borders[] = {
        VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE,
        VK_SAMPLER_ADDRESS_MODE_REPEAT,
        VK_SAMPLER_ADDRESS_MODE_MIRRORED_REPEAT,
        VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_BORDER,  // zeros by default
    };
    const bool filters =
        !(sampling & VKB_SAMPLING_NEAREST)
        && vkb_device_supports(device, format, VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT);
    VkSampler *kept = &bindings->samplers[filters ? sampling : sampling | VKB_SAMPLING_NEAREST];

    if (!*kept
        && !vkb_sampler_create(device, filters ? VK_FILTER_LINEAR : VK_FILTER_NEAREST,
                               borders[sampling / VKB_SAMPLING_REPEAT], kept, error))
        return false;
    *sampler = *kept;
    return true;
}

uint32_t vkb_pass_descriptor_images(const struct vkb_pass_row *pass)
{
    return pass->textured ? 2 : pass->geometry == VKB_GEOMETRY_SKYBOX ? 1 : pass->read_count;
}

uint32_t vkb_pass_bound_image(const struct vkb_pass_row *pass, uint32_t slot)
{
    for (uint32_t i = 0; pass->reads[slot] == VKB_NO_IMAGE && i < pass->read_count; ++i)
        if (pass->reads[i] != VKB_NO_IMAGE)
            return pass->reads[i];
    return pass->reads[slot];
}

VkPipelineBindPoint vkb_pass_bind_point(const struct vkb_pass_row *pass)
{
    return pass->geometry == VKB_GEOMETRY_DISPATCH ? VK_PIPELINE_BIND_POINT_COMPUTE
                                                   : VK_PIPELINE_BIND_POINT_GRAPHICS;
}

// The descriptors after the parameters: the images read, the resources, a dispatch's targets.
static struct vkb_pass_layouts described(const struct vkb_pass_row *pass)
{
    // Of the images read and of the targets.
    static const VkDescriptorType types[][2] = {
        [VKB_READING_SAMPLED] = {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
                                 VK_DESCRIPTOR_TYPE_STORAGE_IMAGE},
        [VKB_READING_LOADED] = {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE},
        [VKB_READING_LINEAR_TEXELS] = {VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER,
                                       VK_DESCRIPTOR_TYPE_STORAGE_BUFFER},
    };
    static const VkDescriptorType resource_types[VKB_RESOURCE_KINDS] = {
        [VKB_RESOURCE_TEXTURE] = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
        [VKB_RESOURCE_IMAGE] = VK_DESCRIPTOR_TYPE_STORAGE_IMAGE,
        [VKB_RESOURCE_UNIFORM] = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER,
        [VKB_RESOURCE_STORAGE] = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
    };
    struct vkb_pass_layouts layouts = {
        .draw = pass->geometry != VKB_GEOMETRY_DISPATCH,
        .reading = pass->reading,
    };

    while (layouts.count < vkb_pass_descriptor_images(pass))
        layouts.descriptors[layouts.count++] = types[pass->reading][0];
    for (uint32_t i = 0; i < pass->resource_count; ++i)
        layouts.descriptors[layouts.count++] = resource_types[pass->resources[i]->kind];
    layouts.stored = layouts.draw ? 0 : pass->target_count;
    for (uint32_t i = 0; i < layouts.stored; ++i)
        layouts.descriptors[TARGET_BINDING - 1 + i] = types[pass->reading][1];
    layouts.count += layouts.stored;
    return layouts;
}

static uint32_t find_layouts(const struct vkb_bindings *bindings,
                             const struct vkb_pass_layouts *layouts)
{
    uint32_t i = 0;

    for (; i < bindings->layout_count; ++i) {
        const struct vkb_pass_layouts *kept = &bindings->layouts[i];
        if (kept->draw == layouts->draw && kept->reading == layouts->reading
            && kept->count == layouts->count
            && memcmp(kept->descriptors, layouts->descriptors, sizeof kept->descriptors) == 0)
            break;
    }
    return i;
}

bool vkb_bindings_prepare(const struct vkb_device *device, struct vkb_bindings *bindings,
                          const struct vkb_pass_row *pass, uint32_t *number,
                          struct vkb_error *error)
{
    struct vkb_pass_layouts layouts = described(pass);

    *number = find_layouts(bindings, &layouts);
    if (*number < bindings->layout_count)
        return true;
    if (!vkb_grow(error, &bindings->layouts, &bindings->layout_capacity, bindings->layout_count + 1,
                  sizeof layouts))
        return false;
    if (!create_layouts(device, &layouts, error)) {
        vkb_layouts_destroy(device, &layouts.made);
        return false;
    }
    bindings->layouts[bindings->layout_count++] = layouts;
    return true;
}

const struct vkb_pass_layouts *vkb_bindings_layouts(const struct vkb_bindings *bindings,
                                                    const struct vkb_pass_row *pass)
{
    const struct vkb_pass_layouts layouts = described(pass);

    return &bindings->layouts[find_layouts(bindings, &layouts)];
}
