// An image from the host: packed into staging memory, where it is kept, so that the same image does
// not travel twice.
#ifndef VKB_UPLOAD_H
#define VKB_UPLOAD_H

#include "memory.h"

#include <stddef.h>

// The caller's pixels as they lie in memory, any strides (in bytes).
struct vkb_input {
    const void *memory;
    ptrdiff_t row_stride, pixel_stride, channel_stride;
    enum vkb_format format;
    uint32_t width, height, channels;
};

struct vkb_upload {
    struct vkb_buffer staging;
    enum vkb_format format;  // of what it holds; NONE: nothing
    uint32_t width, height, channels;
    uint64_t nan_count, inf_count;  // in what it holds
};

void vkb_upload_destroy(const struct vkb_device *device, struct vkb_upload *upload);

// Packs the image to RGBA, alpha 1 where it has none; *changed: it is another one than the last.
bool vkb_upload_stage(const struct vkb_device *device, struct vkb_upload *upload,
                      const struct vkb_input *input, bool *changed, struct vkb_error *error);

// Records the copy of what is staged to the image.
void vkb_upload_record(const struct vkb_device *device, VkCommandBuffer commands,
                       const struct vkb_upload *upload, struct vkb_image *image);

#endif
