// The images that are kept from frame to frame, each under its name and with a description of how
// it was made. An image is replaced when a graph needs another size or format. It is destroyed when
// it is old and the images take much memory.
#ifndef VKB_IMAGE_CACHE_H
#define VKB_IMAGE_CACHE_H

#include "execute/age.h"
#include "graph/plan.h"
#include "vulkan/image.h"

struct vkb_cached_image {
    char name[VKB_NAME_SIZE];
    bool array;  // the images of batches are other ones
    struct vkb_image image;
    uint64_t used;  // the last submission that used it
    struct vkb_content content;
};

struct vkb_image_cache {
    struct vkb_cached_image **images;  // pointers, since the elements must not move
    size_t count, capacity;
    uint64_t clock;            // the last version that was assigned
    uint64_t now;              // the number of the submission that uses them
    struct vkb_spares spares;  // of images that were replaced
    // The most bytes that images took, and the submission that began with them: one of the last
    // VKB_MIN_AGE.
    uint64_t peak, peaked;
};

// Bytes of all images' pixels, and of spare memory.
uint64_t vkb_image_cache_size(const struct vkb_image_cache *cache);

// Begins a submission. If the images take more than VKB_KEPT_IMAGE_BYTES, the old ones are
// destroyed, the oldest first, until they take half of that. Spare memory counts as an image, and
// takes no more than the most that images took in the last submissions.
enum { VKB_KEPT_IMAGE_BYTES = 256 << 20 };
void vkb_image_cache_trim(const struct vkb_device *device, struct vkb_image_cache *cache,
                          const struct vkb_age *age);

void vkb_image_cache_destroy(const struct vkb_device *device, struct vkb_image_cache *cache);

// Whether the image has the row's size, format and usage; and the creation of such an image outside
// of the cache.
bool vkb_image_fits(const struct vkb_image *image, const struct vkb_image_row *row);
bool vkb_image_create_row(const struct vkb_device *device, const struct vkb_image_row *row,
                          struct vkb_spares *spares, struct vkb_image *image,
                          struct vkb_error *error);

// Finds the cached image of a row; NULL if there is none of its size, format and usage.
struct vkb_cached_image *vkb_image_cache_find(const struct vkb_image_cache *cache,
                                              const struct vkb_image_row *row);

// The entry of a row, whose image has memory only if it fits. Pending commands must not use one
// that does not, which is destroyed. NULL and a filled error on failure.
struct vkb_cached_image *vkb_image_cache_entry(const struct vkb_device *device,
                                               struct vkb_image_cache *cache,
                                               const struct vkb_image_row *row,
                                               struct vkb_error *error);

// Gives the memory of an image to an entry that has none and whose row it fits. The content is
// lost.
void vkb_image_cache_move(const struct vkb_device *device, struct vkb_cached_image *from,
                          struct vkb_cached_image *to);

// Whether vkb_image_cache_add for the row would destroy an image.
bool vkb_image_cache_replaces(const struct vkb_image_cache *cache, const struct vkb_image_row *row);

// Creates the cached image of a row that was not found. Pending commands must not use one of
// another size, format or usage, which is replaced. NULL and a filled error on failure.
struct vkb_cached_image *vkb_image_cache_add(const struct vkb_device *device,
                                             struct vkb_image_cache *cache,
                                             const struct vkb_image_row *row,
                                             struct vkb_error *error);

#endif
