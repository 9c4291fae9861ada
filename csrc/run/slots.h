// The images that live from frame to frame, each under its name, with what it was made from. An
// image is kept until a graph wants another size or format of it, or until it is old and the images
// take much memory.
#ifndef VKB_SLOTS_H
#define VKB_SLOTS_H

#include "graph/plan.h"
#include "run/age.h"
#include "vulkan/memory.h"

struct vkb_slot {
    char name[VKB_NAME_SIZE];
    struct vkb_image image;
    uint64_t image_id;  // given anew each time that the image is created
    uint64_t used;      // by which submission last
    struct vkb_content content;
};

struct vkb_framebuffer_entry;

struct vkb_slots {
    struct vkb_slot **slots;  // pointers, so that they stay where they are
    size_t count, capacity;
    uint64_t clock;  // the last id or version given out
    uint64_t now;    // the number of the submission that uses them
    struct vkb_framebuffer_entry *framebuffers;
    size_t framebuffer_count, framebuffer_capacity;
};

// Bytes of all images' pixels.
uint64_t vkb_slots_size(const struct vkb_slots *slots);

// Begins a submission. Where the images take more than VKB_KEPT_IMAGE_BYTES, the old ones are
// destroyed with their framebuffers, the oldest first, until half of that is left.
enum { VKB_KEPT_IMAGE_BYTES = 256 << 20 };
void vkb_slots_trim(const struct vkb_device *device, struct vkb_slots *slots,
                    const struct vkb_age *age);

void vkb_slots_destroy(const struct vkb_device *device, struct vkb_slots *slots);

// Whether the device can have the graph's images and do with them what the passes do.
bool vkb_slots_check(const struct vkb_device *device, const struct vkb_graph *graph,
                     struct vkb_error *error);

// The slot of an image row where it holds an image of the row's size and format, else NULL.
struct vkb_slot *vkb_slots_find(const struct vkb_slots *slots, const struct vkb_image_row *row);

// Whether vkb_slots_resolve destroys an image to make one of the row's size and format: nothing
// that the device still has to run may use it.
bool vkb_slots_replaces(const struct vkb_slots *slots, const struct vkb_image_row *row);

// The slot of an image row, with an image of the row's size and format in it.
bool vkb_slots_resolve(const struct vkb_device *device, struct vkb_slots *slots,
                       const struct vkb_image_row *row, struct vkb_slot **slot,
                       struct vkb_error *error);

// The framebuffer of those targets, kept until one of their images is replaced.
bool vkb_slots_framebuffer(const struct vkb_device *device, struct vkb_slots *slots,
                           struct vkb_slot **targets, uint32_t target_count,
                           VkRenderPass render_pass, VkFramebuffer *framebuffer,
                           struct vkb_error *error);

#endif
