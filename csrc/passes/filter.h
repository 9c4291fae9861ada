// Passes that filter an image by a few taps along both axes (shaders/lib/filter.glsl). The row has
// the filter as data (graph/filter.h): parameters, all variants and the transpose are made from it.
#ifndef VKB_FILTER_H
#define VKB_FILTER_H

#include "passes/levels.h"

// Taps of a kernel at this distance on both sides, and in the middle; one tap in the middle.
struct vkb_kernel vkb_sides(double distance, double side, double middle);
struct vkb_kernel vkb_centre(void);

// The filter from one image to another that is the sum of kernels, each along x and along y, times
// a gain. All kernels together have at most MAX_FILTER_TAPS places along an axis.
struct vkb_filter vkb_make_filter(const struct vkb_graph *graph, uint32_t from, uint32_t to,
                                  const struct vkb_kernel (*kernels)[2], uint32_t count,
                                  double gain);

// Makes both axes of a filter those of 3 x 3 taps, of which the outer ones have the share `side`
// along an axis.
void vkb_filter_three(struct vkb_filter *filter, double distance, double side);

// Whether the positions of a filter are not those of the images' sizes (vkb_axis_align).
bool vkb_is_moved(const struct vkb_filter *filter);

// Sets what the taps of a filter sample, of UPSAMPLE_*.
void vkb_set_kind(struct vkb_filter *filter, enum vkb_mode kind);

// Adds the pass that filters `from` into `to`; the one that also adds the share of an image of the
// size of `to`.
void vkb_add_filter_pass(struct vkb_levels *levels, const struct vkb_filter *filter, uint32_t from,
                         uint32_t to);
void vkb_add_mixed_filter_pass(struct vkb_levels *levels, const struct vkb_filter *filter,
                               uint32_t from, uint32_t same_size, double same_size_share,
                               uint32_t to);

// Passes of dual Kawase (Bjorge, "Bandwidth-Efficient Rendering", SIGGRAPH 2015). Down: four times
// the centre, and four diagonal taps at a distance of half a texel times the offset. Up: four axial
// taps at a distance of one texel of the smaller level times the offset, and four diagonal ones at
// half that distance with twice the weight.
void vkb_kawase_down(struct vkb_levels *levels, double offset, uint32_t from, uint32_t to);
void vkb_kawase_up(struct vkb_levels *levels, double offset, uint32_t from, uint32_t to);
// The images up_N-2 ... up_0 from the last level, and the passes up to them; the last image.
uint32_t vkb_kawase_rise(struct vkb_levels *levels, double offset);

// Whether the pass filters an image by a few taps, and may add another one.
static inline bool vkb_is_filter(const struct vkb_pass_row *pass)
{
    return vkb_computes(pass, VKB_BLOCK_filter) && !pass->constants.levels
        && !pass->filters->x.kernel.count && !pass->filters->y.kernel.count;
}

#endif
