// Blur passes with a symmetric kernel, in one direction or in both.
#ifndef VKB_BLUR_H
#define VKB_BLUR_H

#include "passes/pass.h"

// A kernel whose taps lie on the texels of its source.
struct vkb_texel_kernel {
    float weights[LINE_RADIUS + 4];  // the half-kernel, then zeros, to a multiple of four
    int radius;
};

struct vkb_blur {
    enum vkb_mode direction;
    double weights[MAX_WEIGHTS];  // of the taps 0, 1, ... to each side
    uint32_t count;
    double gain;            // factor of the sum
    const double *offsets;  // of these taps in steps; NULL: 0, 1, ...
    double step_x, step_y;  // the distance of two taps in a row and in a column, in source texels
    bool inset;             // no tap is beyond the middle of the last two columns
    bool filter;            // the sampler filters taps between texels; otherwise the shader does
};

// The row of a blur from one image to another. If all pixels of the target are on texel centres,
// taps between texels are distributed to the two neighbours. Then no variant of the pass has to
// filter.
struct vkb_pass_row vkb_blur_row(const struct vkb_graph *graph, const char *name,
                                 const struct vkb_blur *blur, uint32_t from, uint32_t to);

// Accessors of a row from vkb_blur_row.
bool vkb_is_line_blur(const struct vkb_pass_row *pass);  // in one direction
enum vkb_mode vkb_blur_direction(const struct vkb_pass_row *pass);
// The kernel on texels. False if taps are between texels, or if it is longer than `limit`.
bool vkb_blur_kernel(const struct vkb_pass_row *pass, int limit, struct vkb_texel_kernel *kernel);

#endif
