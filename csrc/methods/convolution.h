// A convolution by Fourier transforms, and its transpose.
#ifndef VKB_METHODS_CONVOLUTION_H
#define VKB_METHODS_CONVOLUTION_H

#include "passes/fft.h"
#include "passes/levels.h"

// Of the kernel along an axis: its pixels, and the offsets that count.
struct vkb_reach {
    uint32_t kernel, first, last;  // the kernel's texels, and those that are not 0
    uint32_t before, after;        // of these, those that count
};

// Both axes of a convolution.
struct vkb_convolution {
    struct vkb_fft_axis x, y;
    struct vkb_reach reach_x, reach_y;
    struct vkb_size result;
    bool pads_rows, pads_columns;  // the kernel's lines
};

// What the passes of a convolution are added with.
struct vkb_convolving {
    struct vkb_levels *levels;
    const struct vkb_convolution *convolution;
    const char *prefix, *suffix;  // of the names of images
    bool transposed;
};

// Of a field of kernels: by what a transform multiplies the pixels that it reads on its way forth,
// or those that it stores on its way back, and what it adds to these. VKB_NO_IMAGE: nothing.
struct vkb_weighing {
    uint32_t weights, channel;
    uint32_t added;
};

static const struct vkb_weighing vkb_unweighted = {.weights = VKB_NO_IMAGE, .added = VKB_NO_IMAGE};

// The convolution of an image of that size with the kernel of the settings.
struct vkb_convolution vkb_describe_convolution(const struct vkb_settings *settings,
                                                struct vkb_size size);

// Makes a description that of the transpose. The result has texels beyond edges that are repeated,
// too, and begins `first` texels before the image.
void vkb_transpose_axes(struct vkb_convolution *convolution);

// The first stage of the first transform, which reads what is convolved. A copy: adding passes
// moves those of the graph.
struct vkb_pass_row vkb_find_transform(const struct vkb_graph *graph);

// Adds the transpose of a convolution of the source's glow, with the spectrum that the convolution
// has.
uint32_t vkb_convolve_back(struct vkb_levels *levels, const struct vkb_convolution *convolution,
                           uint32_t spectrum, const struct vkb_image_row *result);

// The parts of a convolution. The size of the padded lines; an image of a spectrum; what a pass of
// a transform has for variants; whether products are with the conjugate spectrum.
struct vkb_size vkb_padded_size(const struct vkb_convolution *convolution);
uint32_t vkb_add_spectrum(const struct vkb_convolving *passes, const char *name,
                          struct vkb_size size);
struct vkb_transform vkb_transform_of(const struct vkb_convolving *passes, uint32_t stages);
bool vkb_conjugates(const struct vkb_convolving *passes);

// Adds the spectrum of a kernel, which is an image of the host; that of an image, along its rows
// and then along its columns; and the way back from a spectrum, along columns and then along the
// rows of the result. It begins with the product with a grey kernel's spectrum, unless that is
// VKB_NO_IMAGE. Or of the source's glow all but the kernel's.
uint32_t vkb_add_kernel_spectrum(const struct vkb_convolving *passes, uint32_t kernel);
uint32_t vkb_add_rows(const struct vkb_convolving *passes, uint32_t from,
                      const struct vkb_weighing *weighing);
uint32_t vkb_add_columns(const struct vkb_convolving *passes, uint32_t rows,
                         const struct vkb_weighing *weighing);
uint32_t vkb_add_columns_back(const struct vkb_convolving *passes, uint32_t spectrum,
                              uint32_t kernel, const struct vkb_weighing *weighing);
uint32_t vkb_add_rows_back(const struct vkb_convolving *passes, uint32_t columns,
                           const struct vkb_weighing *weighing, const struct vkb_image_row *result);
uint32_t vkb_add_product(const struct vkb_convolving *passes, uint32_t spectrum,
                         const struct vkb_image_row *result);

#endif
