// An image from the host: packed into staging memory, or into the device's image itself where the
// host can write to that. There it is kept, so that the same image does not travel twice.
#ifndef VKB_UPLOAD_H
#define VKB_UPLOAD_H

#include "run/submission.h"

#include <stddef.h>

// The caller's pixels as they lie in memory, any strides (in bytes).
struct vkb_input {
    const void *memory;
    ptrdiff_t row_stride, pixel_stride, channel_stride;
    enum vkb_format format;
    uint32_t width, height, channels;
};

struct vkb_specials {
    uint64_t nan, inf;
};

struct vkb_upload {
    struct vkb_buffer staging;
    unsigned char *pixels;  // the image that it holds, packed: in the staging or mapped
    size_t row_pitch;
    enum vkb_format format;  // of what it holds; NONE: nothing
    uint32_t width, height, channels;
    struct vkb_specials *rows;     // in each row of what it holds
    struct vkb_specials specials;  // in all
    unsigned char *packed;         // one row, to be compared
    size_t row_capacity, packed_capacity;
};

void vkb_upload_destroy(const struct vkb_device *device, struct vkb_upload *upload);

// What it holds is not compared with the next image.
void vkb_upload_forget(struct vkb_upload *upload);

// Packs the image to its format, alpha 1 where it has none; *changed: it is another one than the
// last. The submissions may still read the last one: they are waited for before it is written over.
// `image` is where the device will read it; if that is mapped, it has it now, else
// vkb_upload_record brings it there.
bool vkb_upload_stage(struct vkb_device *device, struct vkb_upload *upload,
                      struct vkb_submissions *submissions, const struct vkb_input *input,
                      const struct vkb_image *image, bool *changed, struct vkb_error *error);

// Records the copy of what is staged to the image.
void vkb_upload_record(const struct vkb_device *device, VkCommandBuffer commands,
                       const struct vkb_upload *upload, struct vkb_image *image);

#endif
