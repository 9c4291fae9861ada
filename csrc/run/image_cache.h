// The images that live from frame to frame, each under its name, with what it was made from. An
// image is kept until a graph wants another size or format of it, or until it is old and the images
// take much memory.
#ifndef VKB_IMAGE_CACHE_H
#define VKB_IMAGE_CACHE_H

#include "graph/plan.h"
#include "run/age.h"
#include "vulkan/memory.h"

struct vkb_cached_image {
    char name[VKB_NAME_SIZE];
    struct vkb_image image;
    uint64_t image_id;  // given anew each time that the image is created
    uint64_t used;      // by which submission last
    struct vkb_content content;
};

struct vkb_framebuffer_entry;

struct vkb_image_cache {
    struct vkb_cached_image **images;  // pointers, so that they stay where they are
    size_t count, capacity;
    uint64_t clock;  // the last id or version given out
    uint64_t now;    // the number of the submission that uses them
    struct vkb_framebuffer_entry *framebuffers;
    size_t framebuffer_count, framebuffer_capacity;
};

// Bytes of all images' pixels.
uint64_t vkb_image_cache_size(const struct vkb_image_cache *cache);

// Begins a submission. Where the images take more than VKB_KEPT_IMAGE_BYTES, the old ones are
// destroyed with their framebuffers, the oldest first, until half of that is left.
enum { VKB_KEPT_IMAGE_BYTES = 256 << 20 };
void vkb_image_cache_trim(const struct vkb_device *device, struct vkb_image_cache *cache,
                          const struct vkb_age *age);

void vkb_image_cache_destroy(const struct vkb_device *device, struct vkb_image_cache *cache);

// Whether the device can have the graph's images and do with them what the passes do.
bool vkb_image_cache_check(const struct vkb_device *device, const struct vkb_graph *graph,
                           struct vkb_error *error);

// The same for one row, without what only passes do.
bool vkb_image_row_check(const struct vkb_device *device, const struct vkb_image_row *row,
                         struct vkb_error *error);
// Whether it is an image of the row's size and format, and such an image outside of the cache.
bool vkb_image_fits(const struct vkb_image *image, const struct vkb_image_row *row);
bool vkb_image_create_row(const struct vkb_device *device, const struct vkb_image_row *row,
                          struct vkb_image *image, struct vkb_error *error);

// The cached of an image row where it holds an image of the row's size and format, else NULL.
struct vkb_cached_image *vkb_image_cache_find(const struct vkb_image_cache *cache,
                                              const struct vkb_image_row *row);

// Whether vkb_image_cache_resolve destroys an image to make one of the row's size and format:
// nothing that the device still has to run may use it.
bool vkb_image_cache_replaces(const struct vkb_image_cache *cache, const struct vkb_image_row *row);

// The cached of an image row, with an image of the row's size and format in it.
bool vkb_image_cache_resolve(const struct vkb_device *device, struct vkb_image_cache *cache,
                             const struct vkb_image_row *row, struct vkb_cached_image **cached,
                             struct vkb_error *error);

// The framebuffer of those targets, kept until one of their images is replaced.
bool vkb_image_cache_framebuffer(const struct vkb_device *device, struct vkb_image_cache *cache,
                                 struct vkb_cached_image **targets, uint32_t target_count,
                                 VkRenderPass render_pass, VkFramebuffer *framebuffer,
                                 struct vkb_error *error);

#endif
