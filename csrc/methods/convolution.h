// A convolution by Fourier transforms, and its transpose.
#ifndef VKB_METHODS_CONVOLUTION_H
#define VKB_METHODS_CONVOLUTION_H

#include "passes/fft.h"

// Of the kernel along an axis: its pixels, and the offsets that count.
struct vkb_reach {
    uint32_t kernel, before, after;
};

// Both axes of a convolution.
struct vkb_convolution {
    struct vkb_fft_axis x, y;
    struct vkb_reach reach_x, reach_y;
    struct vkb_size result;
    bool pads_rows, pads_columns;  // the kernel's lines
};

// The convolution of an image of that size with the kernel of the settings.
struct vkb_convolution vkb_describe_convolution(const struct vkb_settings *settings,
                                                struct vkb_size size);

// Adds the convolution of the source's glow with the kernel of the settings. `result` has the name
// and the format of the image that it writes and returns, and whether this is a framebuffer.
uint32_t vkb_convolve(struct vkb_levels *levels, const struct vkb_image_row *result);

// Makes a description that of the transpose. The result has texels beyond edges that are repeated,
// too, and begins `first` texels before the image.
void vkb_transpose_axes(struct vkb_convolution *convolution);

// Adds the transpose of a convolution of the source's glow, with the spectrum that the convolution
// has.
uint32_t vkb_convolve_back(struct vkb_levels *levels, const struct vkb_convolution *convolution,
                           uint32_t spectrum, const struct vkb_image_row *result);

#endif
