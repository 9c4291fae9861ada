// The sets of taps of params.h (TAP_SETS) in C: where their taps are, and the filters that their
// means and their kernels are.
#ifndef VKB_TAP_SETS_H
#define VKB_TAP_SETS_H

#include "passes/taps.h"

// Whether the set is one of nine taps along an axis. The other functions are of other sets.
bool vkb_is_line_set(int32_t set);

// The number of kernels of a set: of four taps, or of one tap each.
uint32_t vkb_count_kernels(int32_t set);
uint32_t vkb_count_taps(int32_t set);

// The window of texels that its taps are in along an axis.
int32_t vkb_find_window(int32_t set);

// Whether its places are texels apart; whether its taps read other texels at each position between
// two texels.
bool vkb_has_texel_places(int32_t set);
bool vkb_moves_texels(int32_t set);

// Replaces the taps of a filter by those of a kernel of the set, or of one of its taps. Places are
// these steps apart.
void vkb_filter_kernel(struct vkb_filter *filter, int32_t set, uint32_t kernel, double step_x,
                       double step_y);
void vkb_filter_tap(struct vkb_filter *filter, int32_t set, uint32_t tap, double step_x,
                    double step_y);

// The same of the mean of all kernels by their shares. False: a filter has no space for its
// kernels, or for its taps.
bool vkb_filter_mean(struct vkb_filter *filter, int32_t set, double step_x, double step_y);

#endif
