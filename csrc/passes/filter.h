// Rows that filter an image. The row says what the filter is: its block has the taps along both
// axes, each with a weight for up to MAX_KERNELS kernels, and its constants what a tap samples
// (UPSAMPLE_*). All variants and the transpose follow from these (shaders/lib/filter.glsl).
#ifndef VKB_FILTER_H
#define VKB_FILTER_H

#include "passes/levels.h"

// Taps of a kernel along an axis: at this distance on both sides, and in the middle.
struct vkb_side_taps {
    double distance, side, middle;
};

// A filter: the sum of its kernels, each along x and along y. All kernels together have at most
// MAX_FILTER_TAPS places along an axis.
struct vkb_taps {
    struct vkb_side_taps kernels[MAX_KERNELS][2];
    enum vkb_mode upsample;  // what a tap samples, of UPSAMPLE_*; 0: UPSAMPLE_LINEAR
    double gain, divisor;    // of the sum; a divisor of 0 is 1
    bool adds_own;           // adds the share of an image of the target's size
    uint32_t own;
    double own_share;
};

// Adds the pass that filters `from` into `to`.
void vkb_add_filter(struct vkb_levels *levels, const struct vkb_taps *filter, uint32_t from,
                    uint32_t to);

// Passes of dual Kawase (Bjorge, "Bandwidth-Efficient Rendering", SIGGRAPH 2015). Down: four times
// the centre, and four diagonal taps at a distance of half a texel times the offset. Up: four axial
// taps at a distance of one texel of the smaller level times the offset, and four diagonal ones at
// half that distance with twice the weight.
void vkb_kawase_down(struct vkb_levels *levels, double offset, uint32_t from, uint32_t to);
void vkb_kawase_up(struct vkb_levels *levels, double offset, uint32_t from, uint32_t to);
// The images up_N-2 ... up_0 from the last level, and the passes up to them; the last image.
uint32_t vkb_kawase_rise(struct vkb_levels *levels, double offset);

static inline bool vkb_is_filter(const struct vkb_pass_row *pass)
{
    return pass->block == VKB_BLOCK_filter;
}

#endif
