// Passes that make something of a set of taps which is no filter: downsamplings that weight them by
// brightness, and the first passes of published methods. The row's constants are a choice of the
// tables of params.h (PREFILTERS); all variants and the adjoint follow from these.
#ifndef VKB_PREFILTER_H
#define VKB_PREFILTER_H

#include "passes/levels.h"

enum vkb_prefilter {
#define VKB_PREFILTER_ENUM(name, taps, combine, before, after) VKB_PREFILTER_##name,
    PREFILTERS(VKB_PREFILTER_ENUM)
#undef VKB_PREFILTER_ENUM
};

// The row of a pass from one image to another. Its taps are texels apart.
struct vkb_pass_row vkb_describe_prefilter(const struct vkb_levels *levels,
                                           enum vkb_prefilter prefilter, uint32_t from,
                                           uint32_t to);

// Sets the distances of places in such a row, in texels of what it reads.
void vkb_set_steps(struct vkb_pass_row *row, double step_x, double step_y);

// Sets the factors of the colours. That of alpha is 1.
void vkb_set_tint(struct vkb_pass_row *row, const float *tint);

// Whether the pass combines samples themselves to their mean; whether that is all of it.
bool vkb_is_mean(const struct vkb_pass_row *pass);
bool vkb_is_linear(const struct vkb_pass_row *pass);

// Whether its tint is a colour of the settings, by which it multiplies in the end.
bool vkb_has_colour(const struct vkb_pass_row *pass);

// Whether cotangents of what it combines are those of its taps, not of its kernels.
bool vkb_differs_by_tap(const struct vkb_pass_row *pass);

#endif
