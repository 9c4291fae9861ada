// Fourier transforms of images along their axes, in place of a blur.
#ifndef VKB_FFT_H
#define VKB_FFT_H

#include "passes/pass.h"

// A length that transforms have: 2^a 3^b 5^c with b and c of at most 2. A line of more than
// FFT_ELEMENTS is transformed in two passes, as `parts` lines of `length` elements and the other
// way round.
struct vkb_fft_axis {
    uint32_t padded, length, parts;  // padded = length * parts
};

// The least such length of at least `least`.
struct vkb_fft_axis vkb_fft_axis(uint32_t least);

// What the first pass along an axis reads, as FFT_BLOCK has it; the rest of the block is filled in
// here.
struct vkb_fft_input {
    enum vkb_mode load;
    enum vkb_boundary boundary;
    struct vkb_fft_params params;
    bool grey;
};

// A transform along one axis.
struct vkb_fft {
    const char *pass;   // name of its passes
    const char *image;  // name of its result, unless `target` is one
    enum vkb_mode direction;
    bool inverse;
    struct vkb_fft_axis axis;
    struct vkb_fft_input input;
    uint32_t from, factor;  // images; the factor is read where products are loaded
    struct vkb_size size;   // of the result
    uint32_t target;        // VKB_NO_IMAGE: an image of single floats is added; else it is written
};

// Adds the passes of a transform; *result is the image that they write.
bool vkb_add_fft(struct vkb_graph *graph, const struct vkb_fft *fft, uint32_t *result,
                 struct vkb_error *error);

#endif
