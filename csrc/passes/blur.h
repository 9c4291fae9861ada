// Blur passes with a symmetric kernel, in one direction or in both.
#ifndef VKB_BLUR_H
#define VKB_BLUR_H

#include "passes/pass.h"

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

// The row of a blur from one image to another. Its block has the half-kernel of a line on the
// texels of its source, a step of 1 apart, wherever the taps are there. If all pixels of the target
// are on texel centres, taps between texels are distributed to the two neighbours, so that no
// variant has to filter.
struct vkb_pass_row vkb_blur_row(const struct vkb_graph *graph, const char *name,
                                 const struct vkb_blur *blur, uint32_t from, uint32_t to);

// Whether the row is a blur in one direction whose kernel is on texels and not longer than `limit`.
bool vkb_is_line(const struct vkb_pass_row *pass, enum vkb_mode direction, int limit);

#endif
