// Images that passes read where the caller has them, on devices that use the host's memory: without
// a copy, and so without anything that the next image could be compared with.
#ifndef VKB_IN_PLACE_H
#define VKB_IN_PLACE_H

#include "execute/image_cache.h"
#include "transfer/upload.h"

struct vkb_in_place {
    struct vkb_cached_image cached;  // its image belongs to a submission
    const void *memory;              // of the last such image; only its address is used
    struct vkb_non_finite non_finite;
};

// Makes place->cached an image over the input's memory, with a new version. The caller destroys the
// image when the device has read it. False if passes cannot read words of this memory. Also false
// for the array that was read last: it may have the same pixels again, so it is worth a copy, with
// which it is compared from then on.
bool vkb_in_place_stage(const struct vkb_device *device, struct vkb_in_place *place,
                        const struct vkb_input *input, uint64_t *clock);

#endif
