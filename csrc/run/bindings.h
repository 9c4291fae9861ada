// The descriptors of a pass: samplers, descriptor set layouts and pipeline layouts. All of them are
// created with the device, because there are few.
#ifndef VKB_BINDINGS_H
#define VKB_BINDINGS_H

#include "graph/graph.h"

// The descriptors after the parameter block.
enum vkb_binding_kind {
    VKB_BINDINGS_DRAW,      // images, each with a sampler
    VKB_BINDINGS_DISPATCH,  // the same, and a storage image as the target
    VKB_BINDINGS_LOAD,      // storage images, the target is one too
    VKB_BINDINGS_WORDS,     // images as words, and the sizes of all images as push constants
    VKB_BINDING_KINDS
};

// Push constants: the sizes of images that are accessed as words (variants/pixels.glsl).
struct vkb_words {
    int32_t target[4];  // width, height, words in a row, first row of the bound buffer
    int32_t reads[VKB_MAX_WORDS][4];  // width, height, words in a row, 0
};

struct vkb_resource_layout;

struct vkb_bindings {
    VkSampler filter, nearest;  // each created at its first use
    // By the number of images that a pass reads.
    VkDescriptorSetLayout set_layouts[VKB_BINDING_KINDS][VKB_MAX_READS + 1];
    VkPipelineLayout layouts[VKB_BINDING_KINDS][VKB_MAX_READS + 1];
    // Of passes with resources, each created at its first use.
    struct vkb_resource_layout *resource_layouts;
    size_t resource_layout_count, resource_layout_capacity;
};

bool vkb_bindings_create(const struct vkb_device *device, struct vkb_bindings *bindings,
                         struct vkb_error *error);
// Destroying a zeroed object is safe.
void vkb_bindings_destroy(const struct vkb_device *device, struct vkb_bindings *bindings);

// The sampler for images of the format. If the device cannot filter the format, shaders only fetch
// texels from it.
bool vkb_bindings_sampler(const struct vkb_device *device, struct vkb_bindings *bindings,
                          enum vkb_format format, VkSampler *sampler, struct vkb_error *error);

// Creates the layouts of a pass with resources, if they are not there. *number differs between
// layouts; 0: the pass has no resources.
bool vkb_bindings_prepare(const struct vkb_device *device, struct vkb_bindings *bindings,
                          const struct vkb_pass_row *pass, uint32_t *number,
                          struct vkb_error *error);

VkDescriptorType vkb_resource_descriptor(const struct vkb_resource *resource);

// The number of images that the pass reads through descriptors, with the scene's cubemap or
// textures.
uint32_t vkb_pass_descriptor_images(const struct vkb_pass_row *pass);

// The types of the descriptors of the images that the pass reads, and of its target.
struct vkb_binding_types {
    VkDescriptorType read, target;
};
struct vkb_binding_types vkb_pass_binding_types(const struct vkb_pass_row *pass);

VkPipelineBindPoint vkb_pass_bind_point(const struct vkb_pass_row *pass);

// The descriptor set layout of the pass, and the pipeline layout with only this set.
VkDescriptorSetLayout vkb_bindings_set_layout(const struct vkb_bindings *bindings,
                                              const struct vkb_pass_row *pass);
VkPipelineLayout vkb_bindings_layout(const struct vkb_bindings *bindings,
                                     const struct vkb_pass_row *pass);

#endif
