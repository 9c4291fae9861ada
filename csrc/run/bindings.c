#include "run/bindings.h"

#include <string.h>

struct vkb_resource_layout {
    enum vkb_binding_kind kind;
    VkDescriptorType descriptors[VKB_MAX_DESCRIPTORS];
    uint32_t count;
    VkDescriptorSetLayout set;
    VkPipelineLayout pipeline;
};

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

struct layouts {
    VkDescriptorSetLayout set;
    VkPipelineLayout pipeline;
};

// Creates the layouts of a pass's descriptors: the parameters and `count` others.
static bool create_layouts(const struct vkb_device *device, enum vkb_binding_kind kind,
                           const VkDescriptorType *descriptors, uint32_t count,
                           struct layouts *layouts, struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;
    const bool draw = kind == VKB_BINDINGS_DRAW;
    const VkShaderStageFlags stages =
        draw ? VK_SHADER_STAGE_FRAGMENT_BIT : VK_SHADER_STAGE_COMPUTE_BIT;
    VkDescriptorSetLayoutBinding rows[VKB_MAX_DESCRIPTORS + 1] = {
        {
            .binding = 0,
            .descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER,
            .descriptorCount = 1,
            .stageFlags = stages | (draw ? VK_SHADER_STAGE_VERTEX_BIT : 0),
        },
    };

    for (uint32_t i = 0; i < count; ++i)
        rows[i + 1] = (VkDescriptorSetLayoutBinding){
            .binding = i + 1,
            .descriptorType = descriptors[i],
            .descriptorCount = 1,
            .stageFlags = stages,
        };
    return VK(error, vk->vkCreateDescriptorSetLayout(
                         device->handle,
                         &(VkDescriptorSetLayoutCreateInfo){
                             .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                             .bindingCount = count + 1,
                             .pBindings = rows,
                         },
                         NULL, &layouts->set))
        && VK(error,
              vk->vkCreatePipelineLayout(device->handle,
                                         &(VkPipelineLayoutCreateInfo){
                                             .sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
                                             .setLayoutCount = 1,
                                             .pSetLayouts = &layouts->set,
                                             .pushConstantRangeCount = kind == VKB_BINDINGS_WORDS,
                                             .pPushConstantRanges =
                                                 &(VkPushConstantRange){
                                                     .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT,
                                                     .size = sizeof(struct vkb_words),
                                                 },
                                         },
                                         NULL, &layouts->pipeline));
}

// The layouts of a pass of that kind that reads so many images, and nothing else.
static bool create_usual(const struct vkb_device *device, struct vkb_bindings *bindings,
                         enum vkb_binding_kind kind, uint32_t images, struct vkb_error *error)
{
    const struct vkb_binding_types types = binding_kinds[kind].types;
    VkDescriptorType descriptors[VKB_MAX_READS + 1];
    struct layouts layouts = {0};

    for (uint32_t i = 0; i < images; ++i)
        descriptors[i] = types.read;
    descriptors[images] = types.target;
    const bool done = create_layouts(device, kind, descriptors,
                                     images + (kind != VKB_BINDINGS_DRAW), &layouts, error);
    bindings->set_layouts[kind][images] = layouts.set;
    bindings->layouts[kind][images] = layouts.pipeline;
    return done;
}

bool vkb_bindings_create(const struct vkb_device *device, struct vkb_bindings *bindings,
                         struct vkb_error *error)
{
    *bindings = (struct vkb_bindings){0};
    bool done = true;

    for (int kind = 0; kind < VKB_BINDING_KINDS; ++kind)
        for (uint32_t images = 0; done && images <= binding_kinds[kind].most_reads; ++images)
            done = create_usual(device, bindings, (enum vkb_binding_kind)kind, images, error);
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
    for (size_t i = 0; i < bindings->resource_layout_count; ++i) {
        vk->vkDestroyPipelineLayout(device->handle, bindings->resource_layouts[i].pipeline, NULL);
        vk->vkDestroyDescriptorSetLayout(device->handle, bindings->resource_layouts[i].set, NULL);
    }
    vkb_free(bindings->resource_layouts);
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

VkDescriptorType vkb_resource_descriptor(const struct vkb_resource *resource)
{
    static const VkDescriptorType types[VKB_RESOURCE_KINDS] = {
        [VKB_RESOURCE_TEXTURE] = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
        [VKB_RESOURCE_IMAGE] = VK_DESCRIPTOR_TYPE_STORAGE_IMAGE,
        [VKB_RESOURCE_UNIFORM] = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER,
        [VKB_RESOURCE_STORAGE] = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
    };

    return types[resource->kind];
}

// The descriptors after the parameters.
static struct vkb_resource_layout described(const struct vkb_pass_row *pass)
{
    struct vkb_resource_layout layout = {.kind = kind_of(pass)};
    const struct vkb_binding_types types = binding_kinds[layout.kind].types;

    while (layout.count < pass->read_count)
        layout.descriptors[layout.count++] = types.read;
    for (uint32_t i = 0; i < pass->resource_count; ++i)
        layout.descriptors[layout.count++] = vkb_resource_descriptor(pass->resources[i]);
    if (layout.kind != VKB_BINDINGS_DRAW)
        layout.descriptors[layout.count++] = types.target;
    return layout;
}

static const struct vkb_resource_layout *find_layout(const struct vkb_bindings *bindings,
                                                     const struct vkb_resource_layout *layout)
{
    for (size_t i = 0; i < bindings->resource_layout_count; ++i) {
        const struct vkb_resource_layout *kept = &bindings->resource_layouts[i];
        if (kept->kind == layout->kind && kept->count == layout->count
            && memcmp(kept->descriptors, layout->descriptors, sizeof kept->descriptors) == 0)
            return kept;
    }
    return NULL;
}

bool vkb_bindings_prepare(const struct vkb_device *device, struct vkb_bindings *bindings,
                          const struct vkb_pass_row *pass, uint32_t *number,
                          struct vkb_error *error)
{
    struct vkb_resource_layout layout = described(pass);
    struct layouts made = {0};

    *number = 0;
    if (pass->resource_count == 0)
        return true;
    const struct vkb_resource_layout *kept = find_layout(bindings, &layout);
    if (!kept) {
        if (!vkb_grow(error, &bindings->resource_layouts, &bindings->resource_layout_capacity,
                      bindings->resource_layout_count + 1, sizeof layout))
            return false;
        const bool done =
            create_layouts(device, layout.kind, layout.descriptors, layout.count, &made, error);
        layout.set = made.set;
        layout.pipeline = made.pipeline;
        if (!done) {
            device->vk.vkDestroyDescriptorSetLayout(device->handle, layout.set, NULL);
            return false;
        }
        bindings->resource_layouts[bindings->resource_layout_count++] = layout;
        kept = &bindings->resource_layouts[bindings->resource_layout_count - 1];
    }
    *number = (uint32_t)(kept - bindings->resource_layouts) + 1;
    return true;
}

VkDescriptorSetLayout vkb_bindings_set_layout(const struct vkb_bindings *bindings,
                                              const struct vkb_pass_row *pass)
{
    const struct vkb_resource_layout layout = described(pass);

    return pass->resource_count
             ? find_layout(bindings, &layout)->set
             : bindings->set_layouts[kind_of(pass)][vkb_pass_descriptor_images(pass)];
}

VkPipelineLayout vkb_bindings_layout(const struct vkb_bindings *bindings,
                                     const struct vkb_pass_row *pass)
{
    const struct vkb_resource_layout layout = described(pass);

    return pass->resource_count
             ? find_layout(bindings, &layout)->pipeline
             : bindings->layouts[kind_of(pass)][vkb_pass_descriptor_images(pass)];
}
