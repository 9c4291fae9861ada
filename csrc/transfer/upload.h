// Upload of images from the host. The pixels are packed into staging memory, or directly into the
// device's image if it is mapped. They are kept there, so that the same image is not uploaded
// twice. The device copies the first rows of a large image while the host packs the others.
#ifndef VKB_UPLOAD_H
#define VKB_UPLOAD_H

#include "execute/submission.h"
#include "share/exported_memory.h"
#include "transfer/non_finite.h"

#include <stddef.h>

// Which pixels of exported memory an image has, whose size and format are its own. Compared byte by
// byte, so it has no padding.
struct vkb_pixels_key {
    uint64_t serial, offset;  // of the memory, whose content does not change; in it
    int64_t row_stride, pixel_stride, channel_stride, layer_stride;
    uint64_t channels;
};

// The caller's pixels, with any strides (in bytes): in host memory, or in memory that CUDA shares,
// from byte `offset` on. Then `format` is one with such elements.
struct vkb_input {
    const void *memory;
    struct vkb_export *exported;  // NULL: in host memory
    size_t offset;
    struct vkb_pixels_key pixels;  // of exported ones
    ptrdiff_t row_stride, pixel_stride, channel_stride;
    enum vkb_format format;
    uint32_t width, height, channels;
    // Of a batch, which only exported memory can hold; 0: it is one image.
    uint32_t layers;
    ptrdiff_t layer_stride;
};

static inline const unsigned char *vkb_input_row(const struct vkb_input *input, uint32_t y)
{
    return (const unsigned char *)input->memory + y * input->row_stride;
}

// Whether the pixels of a row, and their channels, follow one another without gaps.
bool vkb_input_is_contiguous(const struct vkb_input *input);

struct vkb_upload {
    struct vkb_buffer staging;
    unsigned char *pixels;  // the packed image that it holds: in staging memory, or mapped
    size_t row_pitch;
    enum vkb_format format;  // of the image that it holds; NONE: no image
    uint32_t width, height, channels;
    struct vkb_non_finite *rows;       // in each row of the image
    struct vkb_non_finite non_finite;  // in the complete image
    unsigned char *packed;             // a row of each part, before it is compared
    size_t row_capacity, packed_capacity;
    uint32_t sent;  // rows whose copy was submitted since the last vkb_upload_record
};

void vkb_upload_destroy(const struct vkb_device *device, struct vkb_upload *upload);

// Discards the image, so that the next one is not compared with it.
void vkb_upload_forget(struct vkb_upload *upload);

// Packs the input in its format, with an alpha of 1 if it has none. *changed becomes true if it
// differs from the last one. Pending submissions may still read the last one, so it is overwritten
// only after a wait for them. `image` is the device's image. If it is mapped, it has the pixels
// now; otherwise vkb_upload_record copies them. Copies of the first rows of a large image are
// submitted before, each as a submission of its own with that number. Without submissions, NULL,
// nothing is compared, waited for or submitted.
bool vkb_upload_stage(struct vkb_device *device, struct vkb_upload *upload,
                      struct vkb_submissions *submissions, uint64_t number,
                      const struct vkb_input *input, struct vkb_image *image, bool *changed,
                      struct vkb_error *error);

// Records the copy of the rows that were not sent yet, from staging memory to the image.
void vkb_upload_record(const struct vkb_device *device, VkCommandBuffer commands,
                       struct vkb_upload *upload, struct vkb_image *image);

#endif
