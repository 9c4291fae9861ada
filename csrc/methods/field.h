// Convolutions with a field of kernels, whose weights depend on the place, and their transposes.
#ifndef VKB_METHODS_FIELD_H
#define VKB_METHODS_FIELD_H

#include "methods/convolution.h"
#include "passes/adjoint.h"

// Adds the sum of the convolutions of the source's glow, as vkb_convolve().
uint32_t vkb_convolve_field(const struct vkb_convolving *passes,
                            const struct vkb_image_row *result);

// Accumulates cotangents of the glow by a pass that ends such a sum.
bool vkb_transpose_field(struct vkb_adjoint *adjoint, const struct vkb_settings *settings,
                         const struct vkb_pass_row *pass, struct vkb_error *error);

#endif
