// Convolutions with the kernels of the settings.
#ifndef VKB_METHODS_CONVOLVE_H
#define VKB_METHODS_CONVOLVE_H

#include "passes/levels.h"

// Adds the convolution of the source's glow with the kernel of the settings. `result` has the name
// and the format of the image that it writes and returns, and whether this is a framebuffer.
uint32_t vkb_convolve(struct vkb_levels *levels, const struct vkb_image_row *result);

#endif
