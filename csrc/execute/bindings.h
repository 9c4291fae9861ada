// The descriptors of a pass: samplers, descriptor set layouts and pipeline layouts. Each is created
// at its first use.
#ifndef VKB_BINDINGS_H
#define VKB_BINDINGS_H

#include "graph/graph.h"

// Push constants: the sizes of images that are accessed as linear texels (variants/pixels.glsl).
struct vkb_linear_texels {
    int32_t target[4];  // width, height, words in a row, first row of the bound buffer
    int32_t reads[VKB_MAX_LINEAR_TEXELS][4];  // width, height, words in a row, 0
};

// A descriptor set layout, and the pipeline layout with only this set.
struct vkb_layouts {
    VkDescriptorSetLayout set;
    VkPipelineLayout pipeline;
};

// `constants`: the bytes of push constants of a compute shader. What is made before a failure is
// left to vkb_layouts_destroy.
bool vkb_layouts_create(const struct vkb_device *device,
                        const VkDescriptorSetLayoutBinding *bindings, uint32_t count,
                        uint32_t constants, struct vkb_layouts *layouts, struct vkb_error *error);
void vkb_layouts_destroy(const struct vkb_device *device, struct vkb_layouts *layouts);

bool vkb_sampler_create(const struct vkb_device *device, VkFilter filter,
                        VkSamplerAddressMode border, VkSampler *sampler, struct vkb_error *error);

// The layouts for passes with these descriptors after the parameters.
struct vkb_pass_layouts {
    bool draw;
    uint32_t stored;  // targets of a dispatch
    enum vkb_reading reading;
    VkDescriptorType descriptors[VKB_MAX_DESCRIPTORS];
    uint32_t count;
    struct vkb_layouts made;
};

struct vkb_bindings {
    VkSampler samplers[VKB_SAMPLINGS];
    struct vkb_pass_layouts *layouts;
    size_t layout_count, layout_capacity;
};

// Destroying a zeroed object is safe.
void vkb_bindings_destroy(const struct vkb_device *device, struct vkb_bindings *bindings);

// The sampler for images of the format. If the device cannot filter the format, shaders only fetch
// texels from it. `sampling`: of VKB_SAMPLING_*.
bool vkb_bindings_sampler(const struct vkb_device *device, struct vkb_bindings *bindings,
                          enum vkb_format format, uint32_t sampling, VkSampler *sampler,
                          struct vkb_error *error);

// Creates the layouts of a pass, if they are not there. *number differs between layouts.
bool vkb_bindings_prepare(const struct vkb_device *device, struct vkb_bindings *bindings,
                          const struct vkb_pass_row *pass, uint32_t *number,
                          struct vkb_error *error);

// The number of images that the pass reads through descriptors, with the scene's cubemap or
// textures.
uint32_t vkb_pass_descriptor_images(const struct vkb_pass_row *pass);

// The image that is bound for a slot. Vulkan needs one for each binding, so that an absent one is
// replaced by the first image that the pass reads. Its shader does not read it.
uint32_t vkb_pass_bound_image(const struct vkb_pass_row *pass, uint32_t slot);

VkPipelineBindPoint vkb_pass_bind_point(const struct vkb_pass_row *pass);

// The layouts of a pass that vkb_bindings_prepare has made.
const struct vkb_pass_layouts *vkb_bindings_layouts(const struct vkb_bindings *bindings,
                                                    const struct vkb_pass_row *pass);

#endif
