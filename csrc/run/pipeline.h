// From a pass row to Vulkan's objects: shader modules, layouts, render pass, pipeline. Each is made
// once for its key. Pipelines that are old are destroyed where there are many; of the others there
// are a few at the most.
#ifndef VKB_PIPELINE_H
#define VKB_PIPELINE_H

#include "graph/graph.h"
#include "run/age.h"

struct vkb_render_pass_entry;
struct vkb_pipeline_entry;

// What the bindings after the parameters are: images read through samplers; with the target of a
// dispatch; storage images with it; words with it, and their sizes as push constants.
enum vkb_binding_kind {
    VKB_BINDINGS_DRAW,
    VKB_BINDINGS_DISPATCH,
    VKB_BINDINGS_LOAD,
    VKB_BINDINGS_WORDS,
    VKB_BINDING_KINDS
};

// Images as words, as variants/words.glsl has them.
struct vkb_words {
    int32_t target[4];                // width, height, words in a row, first row of what is bound
    int32_t reads[VKB_MAX_LOADS][4];  // width, height, words in a row
    uint32_t zero;
};

struct vkb_pipelines {
    VkPipelineCache cache;
    VkSampler filter, nearest;  // of images; without a filter those that are only fetched from
    VkShaderModule modules[VKB_SHADER_COUNT];
    // By the number of images read.
    VkDescriptorSetLayout set_layouts[VKB_BINDING_KINDS][VKB_MAX_READS + 1];
    VkPipelineLayout layouts[VKB_BINDING_KINDS][VKB_MAX_READS + 1];
    struct vkb_render_pass_entry *render_passes;
    struct vkb_pipeline_entry *entries;
    size_t render_pass_count, render_pass_capacity;
    size_t entry_count, entry_capacity;
    size_t created;  // pipelines, so far
    uint64_t now;    // the number of the submission that uses them
};

// `cache_data` may be NULL; what the driver does not know it ignores.
bool vkb_pipelines_create(const struct vkb_device *device, const void *cache_data,
                          size_t cache_size, struct vkb_pipelines *pipelines,
                          struct vkb_error *error);
void vkb_pipelines_destroy(const struct vkb_device *device, struct vkb_pipelines *pipelines);

// What the driver wants kept for the next time; the caller frees *data with vkb_free.
bool vkb_pipelines_save(const struct vkb_device *device, const struct vkb_pipelines *pipelines,
                        void **data, size_t *size, struct vkb_error *error);

// Begins a submission. Where there are more than VKB_KEPT_PIPELINES, the old ones are destroyed,
// the oldest first, until half of that is left.
enum { VKB_KEPT_PIPELINES = 256 };
void vkb_pipelines_trim(const struct vkb_device *device, struct vkb_pipelines *pipelines,
                        const struct vkb_age *age);

// The render pass of the passes first..end-1, with the dependencies that follow from their rows.
bool vkb_pipelines_render_pass(const struct vkb_device *device, struct vkb_pipelines *pipelines,
                               const struct vkb_graph *graph, uint32_t first, uint32_t end,
                               VkRenderPass *render_pass, struct vkb_error *error);

// `render_pass` is VK_NULL_HANDLE for a dispatch.
bool vkb_pipelines_get(const struct vkb_device *device, struct vkb_pipelines *pipelines,
                       const struct vkb_pass_row *pass, VkRenderPass render_pass,
                       VkPipeline *pipeline, struct vkb_error *error);

// The sampler of the package's own images of the format.
VkSampler vkb_pipelines_sampler(const struct vkb_device *device,
                                const struct vkb_pipelines *pipelines, enum vkb_format format);

// How many images the pass reads by descriptor, the scene's cubemap or textures counted in.
uint32_t vkb_pass_descriptor_images(const struct vkb_pass_row *pass);

// The types of the descriptors that the pass reads and writes images by.
struct vkb_binding_types {
    VkDescriptorType read, target;
};
struct vkb_binding_types vkb_pass_binding_types(const struct vkb_pass_row *pass);

enum vkb_binding_kind vkb_pass_binding_kind(const struct vkb_pass_row *pass);
VkPipelineBindPoint vkb_pass_bind_point(const struct vkb_pass_row *pass);

// The layout of the descriptors that fit the pass, and the pipeline layout of just them.
VkDescriptorSetLayout vkb_pipelines_set_layout(const struct vkb_pipelines *pipelines,
                                               const struct vkb_pass_row *pass);
VkPipelineLayout vkb_pipelines_layout(const struct vkb_pipelines *pipelines,
                                      const struct vkb_pass_row *pass);

#endif
