// Images that stay on the device as long as there is a handle of them. Calls must not overlap; the
// core makes them with the GIL or vkb_memory, and calls the last three functions with the
// renderer's lock.
#ifndef VKB_RESIDENT_H
#define VKB_RESIDENT_H

#include "execute/image_cache.h"
#include "transfer/upload.h"

struct vkb_resident {
    struct vkb_resident *previous, *next;  // in the list of its renderer
    struct vkb_resident_image {
        struct vkb_cached_image cached;  // not part of the image cache
        struct vkb_upload upload;
    } inputs[VKB_INPUT_COUNT];  // by kind
    struct vkb_non_finite non_finite;
    bool uncounted;  // the device has made the image, so that nobody knows its NaN and infinity
    uint32_t uses;   // submissions that use it and may still run
    bool staged;     // its pixels are in staging memory, and the next submission copies them
    bool recycled;   // will get other pixels, so it keeps its staging memory
};

struct vkb_residents;

struct vkb_residents *vkb_residents_create(const struct vkb_device *device,
                                           struct vkb_error *error);
// Must be called before the device is destroyed, and when it has finished all work on the images.
// Destroys the images; each struct stays until it is released. `residents` may be NULL.
void vkb_residents_close(struct vkb_residents *residents);

// Adds an element without an image.
struct vkb_resident *vkb_resident_add(struct vkb_residents *residents, struct vkb_error *error);
// The device must have finished all work on it.
void vkb_resident_release(struct vkb_residents *residents, struct vkb_resident *resident);

// Ends a use by a submission: after the device has finished it, or if there was none.
void vkb_resident_end_use(struct vkb_residents *residents, struct vkb_resident *resident);

// Gives an element without an image that of a cached image, with its content; the cached one is
// then without. It is of the kind VKB_INPUT_IMAGE: a history is in all ways an image that was
// uploaded.
void vkb_resident_take(struct vkb_resident *resident, struct vkb_cached_image *from);

// Creates the image of this kind, with the input's size, format and pixels. No submission may use
// the element. The input is read before this returns.
bool vkb_resident_fill(struct vkb_device *device, struct vkb_resident *resident,
                       enum vkb_input_kind kind, const struct vkb_input *input, uint64_t *clock,
                       struct vkb_error *error);

#endif
