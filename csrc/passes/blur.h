// Passes of a filter with a symmetric kernel along one axis, or along both in one pass.
#ifndef VKB_BLUR_H
#define VKB_BLUR_H

#include "passes/pass.h"

// The row of a filter whose axes x, y or both have a kernel; those of both are equal but for their
// steps. Wherever the taps are on texels, the row's filter has them there, a step of 1 apart. If
// all pixels of the target are on texel centres, taps between texels are distributed to the two
// neighbours, so that no variant has to filter. Otherwise the sampler filters them with `sampled`,
// or the shader.
struct vkb_pass_row vkb_blur_row(struct vkb_levels *levels, const struct vkb_filter *filter,
                                 bool sampled, uint32_t from, uint32_t to);

// The kernel of an axis from texels to texels that are at most `limit` away; NULL: it has none.
const struct vkb_kernel *vkb_texel_kernel(const struct vkb_axis *axis, uint32_t limit);

// Writes the weights of a kernel times a gain, four in a vec4.
void vkb_fill_weights(const struct vkb_kernel *kernel, double gain, float (*weights)[4]);

// The kernel of a row that is a filter along one axis, from texels to texels that are at most
// `limit` away; NULL: it is none.
const struct vkb_kernel *vkb_line_of(const struct vkb_pass_row *pass, enum vkb_mode direction,
                                     uint32_t limit);

#endif
