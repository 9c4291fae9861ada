// The pipelines of pass rows. Each is created once for its key. If there are many, the old ones are
// destroyed.
#ifndef VKB_PIPELINE_H
#define VKB_PIPELINE_H

#include "execute/age.h"
#include "execute/bindings.h"

#ifdef VKBLOOM_FAULTS
// Whether the driver folds the constants of the pipelines that are created from now on, in place of
// vkb_specialize: tests compare both.
extern bool vkb_driver_folds;
#endif

struct vkb_pipeline_entry;

struct vkb_pipelines {
    VkPipelineCache cache;
    struct vkb_bindings bindings;
    struct vkb_pipeline_entry *entries;
    size_t entry_count, entry_capacity;
    size_t created;  // pipelines created so far
    uint64_t now;    // the number of the submission that uses them
};

// `cache_data` may be NULL. The driver ignores data of another driver.
bool vkb_pipelines_create(const struct vkb_device *device, const void *cache_data,
                          size_t cache_size, struct vkb_pipelines *pipelines,
                          struct vkb_error *error);
void vkb_pipelines_destroy(const struct vkb_device *device, struct vkb_pipelines *pipelines);

// The content of the pipeline cache, to be stored for the next process. The caller frees *data with
// vkb_free.
bool vkb_pipelines_save(const struct vkb_device *device, const struct vkb_pipelines *pipelines,
                        void **data, size_t *size, struct vkb_error *error);

// Begins a submission. If there are more than VKB_KEPT_PIPELINES, the old ones are destroyed, the
// oldest first, until half of that number is left.
enum { VKB_KEPT_PIPELINES = 256 };
void vkb_pipelines_trim(const struct vkb_device *device, struct vkb_pipelines *pipelines,
                        const struct vkb_age *age);

// The pipeline of a pass of the graph, or of a changed copy of one.
bool vkb_pipelines_get(const struct vkb_device *device, struct vkb_pipelines *pipelines,
                       const struct vkb_graph *graph, const struct vkb_pass_row *pass,
                       VkPipeline *pipeline, struct vkb_error *error);

// Creates the pipelines of passes that do not exist, several at the same time: a driver takes 5 to
// 20 ms for each (the first call of `playcanvas` takes 0.16 s in place of 0.25; two cores, filled
// caches, lavapipe of Mesa 22.3.6, 2026-11-29). It cannot fail: what is not created here is left to
// vkb_pipelines_get.
void vkb_pipelines_create_together(struct vkb_device *device, struct vkb_pipelines *pipelines,
                                   const struct vkb_graph *graph, const struct vkb_pass_row *rows,
                                   uint32_t count);

// Creates a compute pipeline, which the caller keeps.
bool vkb_compute_create(const struct vkb_device *device, VkPipelineCache cache,
                        const struct vkb_shader *shader, const struct vkb_constants *constants,
                        VkPipelineLayout layout, VkPipeline *pipeline, struct vkb_error *error);

#endif
