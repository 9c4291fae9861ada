// Fourier transforms of all lines along an axis by the host, on devices whose images are in its
// memory.
//
// An image of spectra has those of the channels, each on its own: in each row the real parts of
// channel 0 with the frequencies 0 to n / 2, their imaginary parts, then those of the next channel.
// The transform of real numbers has no others. It is as wide as an image of four channels of that;
// of a grey kernel it has one channel, and is as wide as that (vkb_host_is_grey).
//
// host_fft_lanes.h has the loops. A line is in one lane from its first to its last element.
#ifndef VKB_HOST_FFT_H
#define VKB_HOST_FFT_H

#include "graph/graph.h"
#include "vulkan/parts.h"

enum { VKB_MAX_FACTORS = 16 };

// How lines of a length are transformed.
struct vkb_host_line {
    uint32_t length, factor_count;
    uint32_t factors[VKB_MAX_FACTORS];  // of the length: 2 to 5
    float *turns;  // cosine and sine of what each factor multiplies its elements by
};

// The length is a product of 2, 3 and 5. False on failure; destroying a zeroed object is safe.
bool vkb_host_line_create(uint32_t length, struct vkb_host_line *line, struct vkb_error *error);
void vkb_host_line_destroy(struct vkb_host_line *line);

// Of a place in a padded line: first, last and step of the places of the kernel that are added up.
struct vkb_kernel_places {
    int32_t first, last, step;
};

// What is done with all lines along an axis.
struct vkb_host_lines {
    struct vkb_host_line line;
    uint32_t half;      // frequencies of a row: n / 2 + 1
    uint32_t channels;  // that are transformed
    int32_t *places;    // by element of a line that is padded: the source's, or -1 for zero
    uint32_t kept;      // elements that are stored
    // `kernel`, `weights` and `added` have no pixels where there are none.
    struct vkb_host_image source, target, kernel, weights, added;
    bool forth, back;
    float kernel_sign;  // of the imaginary parts
    // Weights: the channel, and the place of the first weight in the result of the way back.
    int32_t weight, before_x, before_y;
    bool cleans;  // what is read: finite, up to FFT_LIMIT
    bool stores;  // as shaders store single floats
    bool opaque;  // with an alpha of 1
    // Of the rows of a kernel: places along rows and columns, and what all values are multiplied
    // by.
    struct vkb_kernel_places *kernel_x, *kernel_y;
    float gain;
    char *space;  // for each part: two lines, and a third one of kernels
    size_t space_size;
};

// Whether an image of spectra, of so many frequencies, has those of a grey kernel; the width of
// such an image.
static inline uint32_t vkb_host_grey_width(uint32_t half)
{
    return (2 * half + 3) / 4;
}

static inline bool vkb_host_is_grey(const struct vkb_host_image *spectra, uint32_t half)
{
    return spectra->width < 2 * half;
}

// Host passes: all stages along an axis, and the sum of products of spectra; of a kernel, which
// they put to its places in the padded lines, all stages along rows.
vkb_host_pass vkb_host_rows_forth, vkb_host_columns, vkb_host_rows_back, vkb_host_products,
    vkb_host_kernel_rows;

#endif
