// Images that stay on the device while somebody has a handle of them. The functions must not
// overlap; the core calls them with the GIL, and the last two with the renderer's lock.
#ifndef VKB_RESIDENT_H
#define VKB_RESIDENT_H

#include "run/image_cache.h"
#include "run/upload.h"

struct vkb_resident {
    struct vkb_resident *previous, *next;  // in the list of its renderer
    struct vkb_resident_image {
        struct vkb_cached_image cached;  // in no cache
        struct vkb_upload upload;
    } inputs[VKB_INPUT_COUNT];  // by kind
    struct vkb_specials specials;
    uint32_t uses;  // submissions that the device may still be at work on
    bool staged;    // its pixels are in staging memory: the next submission copies them
    bool recycled;  // gets other pixels when this is over: keeps its staging memory
};

struct vkb_residents;

struct vkb_residents *vkb_residents_create(const struct vkb_device *device,
                                           struct vkb_error *error);
// Before the device goes, which must be done with all of them: the images go, what is left of each
// stays until it is released. May be NULL.
void vkb_residents_close(struct vkb_residents *residents);

// One without an image.
struct vkb_resident *vkb_resident_add(struct vkb_residents *residents, struct vkb_error *error);
// The device must be done with it.
void vkb_resident_release(struct vkb_residents *residents, struct vkb_resident *resident);

// A submission reads it; the device is done with the submission, or there is none.
void vkb_resident_use(struct vkb_resident *resident);
void vkb_resident_end_use(struct vkb_residents *residents, struct vkb_resident *resident);

// Makes one of its images one of the input's kind, whose pixels come by vkb_resident_fill. Nothing
// may use it.
bool vkb_resident_begin(struct vkb_device *device, struct vkb_resident *resident,
                        enum vkb_input_kind kind, const struct vkb_input *input, uint64_t *clock,
                        struct vkb_error *error);
// Gives it rows, from `first` on, which it must have, before a submission uses it. The input is
// read before this returns.
bool vkb_resident_fill(struct vkb_device *device, struct vkb_resident *resident,
                       enum vkb_input_kind kind, const struct vkb_input *input, uint32_t first,
                       struct vkb_error *error);

#endif
