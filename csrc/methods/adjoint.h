// The graph of derivatives: that of an image, and the adjoint passes of those that lead from the
// image to framebuffers with cotangents.
#ifndef VKB_METHODS_ADJOINT_H
#define VKB_METHODS_ADJOINT_H

#include "graph/graph.h"
#include "methods/source.h"
#include "passes/transposes.h"

// The framebuffers with cotangents, which are the levels of the source.
struct vkb_cotangents {
    vkb_image_name names[GATHERED_LEVELS];
    uint32_t count;
    bool images;                  // the derivatives by images are wanted
    bool weights;                 // those by the weights of a field of kernels
    struct vkb_wanted_sums sums;  // those by fields
};

// Adds the framebuffers ".by_image", ".by_emission" and ".by_mask", of those that the source has
// and that the cotangents depend on. And those of the sums that are wanted, where passes have them.
// They are of one pixel, with the sums of the squares below it:
// - ".by_composite": by intensity, exposure, reference white;
// - ".by_threshold": by threshold and knee; in its place ".by_light": the derivative by a factor of
//   the light above the threshold, too, if that is the one by the intensity, times the intensity;
// - ".by_own_threshold": of a threshold within a pass of taps, what by_point() of lib/points.glsl
//   has;
// - ".by_shares_0" and so on: the cotangents of a sum of two levels times the one of its size, and
//   times the sum;
// - ".by_levels_0" and so on: of a level that a pass adds up to others, each channel times its
//   cotangents from this pass; ".by_stages_0" and so on: the same of the bloom, and of stages of
//   glare without dirt;
// - ".by_colour": the same of the first level;
// - ".by_enlarging_x_0", ".by_reducing_y_1" and so on: of a pass and an axis, what the pass reads
//   times the transpose of its slopes;
// - ".by_weight_0_0" and so on: of a blur's axis, by four weights, from four times this number on.
// Of the weights of a field of kernels: ".by_weights_0" and so on, of four weights each at the
// places of their grid, unless that has more places than images have pixels. *first is the index of
// the first image that is added. *possible becomes false if a pass has no adjoint.
bool vkb_build_adjoint(const struct vkb_source *source, const struct vkb_settings *settings,
                       const struct vkb_cotangents *cotangents, uint32_t max_side,
                       struct vkb_transposes *transposes, struct vkb_graph *graph, uint32_t *first,
                       bool *possible, struct vkb_error *error);

struct vkb_adjoint;

// The adjoint passes of a convolution, whose last pass this is.
bool vkb_transpose_convolution(struct vkb_adjoint *adjoint, const struct vkb_settings *settings,
                               const struct vkb_pass_row *pass, struct vkb_error *error);

#endif
