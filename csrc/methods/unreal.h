// Which of Unreal Engine's standard blooms need no kernel from the host.
#ifndef VKB_METHODS_UNREAL_H
#define VKB_METHODS_UNREAL_H

#include "passes/pass.h"

// Whether the settings are those of a sum of Gaussians that is made of blurs and levels, for these
// sizes, and of no convolution with a kernel.
bool vkb_has_gaussian_levels(const struct vkb_settings *settings, struct vkb_size frame,
                             struct vkb_size buffers);

#endif
