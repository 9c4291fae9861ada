// Fourier transforms of images along their axes, in place of a blur.
#ifndef VKB_FFT_H
#define VKB_FFT_H

#include "passes/pass.h"

enum { VKB_FFT_STAGES = 4 };

// A line of `length` elements, transformed in stages: its length is the product of their radices.
struct vkb_fft_line {
    uint32_t length;
    uint32_t stage_count;
    uint32_t radices[VKB_FFT_STAGES];  // then 1
};

// The line of at least `least` elements, up to 32768, that takes the least time.
struct vkb_fft_line vkb_fft_line(uint32_t least);

// The radices of a length for stages in shared memory, VKB_FFT_STAGES of up to FFT_MAX_RADIX each,
// the longest first. False: there are none.
bool vkb_fft_group_radices(uint32_t length, uint32_t *found);

// How the lines lie, and which of their elements exist before the transform.
struct vkb_fft_axis {
    enum vkb_mode direction;
    enum vkb_boundary boundary;  // not wrap_x
    uint32_t extent;             // texels of the image along the axis
    uint32_t before;             // of which a kernel reaches so many on one side
    uint32_t first;              // elements before the first texel; above 0 only with zeros beyond
    struct vkb_fft_line line;
};

// A stage of the forward or inverse transform of all lines along an axis, from one image of single
// floats to another or to itself. The caller may change the row.
struct vkb_fft_stage {
    const char *name;
    const struct vkb_fft_axis *axis;
    uint32_t number;  // of the stage, on the way forth
    uint32_t lines;
    bool inverse;
    bool padded;  // the source has `extent` texels along the axis
    uint32_t from, to;
};

struct vkb_pass_row vkb_fft_row(const struct vkb_graph *graph, const struct vkb_fft_stage *stage);

// Makes a product with the spectrum of a kernel, or with its conjugate, of the last stage along
// columns, and of the first stage back.
void vkb_fft_multiply(const struct vkb_fft_axis *rows, const struct vkb_fft_axis *columns,
                      uint32_t spectrum, bool grey, bool conjugate, struct vkb_pass_row *row);

#endif
