// Runs a graph: what is out of date is recorded, timed, submitted and waited for, and the images
// that are wanted come back to the host.
#ifndef VKB_FRAME_H
#define VKB_FRAME_H

#include "commands.h"
#include "graph.h"
#include "pipeline.h"
#include "readback.h"
#include "scene.h"
#include "slots.h"
#include "timing.h"
#include "upload.h"

// Everything that lives from frame to frame.
struct vkb_frame {
    struct vkb_commands commands;
    struct vkb_pipelines pipelines;
    struct vkb_scene scene;
    struct vkb_upload upload;
    struct vkb_readback readback;
    struct vkb_buffer uniforms;
    struct vkb_timer timer;
    struct vkb_slots slots;
    VkDescriptorPool descriptors;
    uint32_t descriptor_capacity;  // in sets
};

// What a graph starts from; what it does not use is NULL.
struct vkb_frame_source {
    const struct vkb_scene_data *scene;
    const struct vkb_input *input;
};

struct vkb_timing {
    char name[VKB_NAME_SIZE];
    double seconds;  // NaN: the queue has no timestamps
};

// Destroying a zeroed or half-built object is fine.
bool vkb_frame_create(const struct vkb_device *device, const void *cache_data, size_t cache_size,
                      struct vkb_frame *frame, struct vkb_error *error);
void vkb_frame_destroy(const struct vkb_device *device, struct vkb_frame *frame);

// Runs what the outputs need of the graph and is out of date, then fills the outputs. `timings` has
// room for every pass of the graph and gets the render passes that ran. `scene` is what the graph
// draws, NULL for one that draws no scene. A failed run leaves the frame usable, unless the device
// is lost.
bool vkb_frame_run(struct vkb_device *device, struct vkb_frame *frame,
                   const struct vkb_frame_source *source, const struct vkb_graph *graph,
                   const struct vkb_output *outputs, uint32_t output_count,
                   struct vkb_timing *timings, uint32_t *timing_count, struct vkb_error *error);

#endif
