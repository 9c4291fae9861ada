// Shared by methods with levels of decreasing size: the images of a chain, its downsampling rows,
// and its upsampling rows.
#ifndef VKB_LEVELS_H
#define VKB_LEVELS_H

#include "passes/pass.h"

// How the bloom is made from the levels: up_k = own[k] down_k + coarse[k] U(up_k+1) with up_N-1 =
// smallest * down_N-1, bloom = gain * V(up_0).
struct vkb_combination {
    enum vkb_mode kernel, last_kernel;  // U and V, of UPSAMPLE_*
    double radius_x, radius_y;          // of a tent filter, in texels of the smaller level
    bool width_step;                    // the radii are relative to the smaller level's width
    bool target_step;                   // the radii are one texel of the larger level
    double same_size[MAX_LEVELS], coarse[MAX_LEVELS];
    double smallest, gain;
};

// A combination with the same `same_size` and `coarse` for all levels.
struct vkb_combination vkb_combine(enum vkb_mode kernel, double same_size, double coarse);

// The widest level of a method that gives its levels a height and the aspect of the frame: 16384,
// or the adapter's limit where that is lower.
double vkb_widest_level(const struct vkb_levels *levels);

// A side times a scale, and half of a size, rounded down, at least 1; half of a size, rounded up.
uint32_t vkb_scaled(uint32_t side, double scale);
struct vkb_size vkb_halved(struct vkb_size size);
struct vkb_size vkb_halved_up(struct vkb_size size);

// Appends sizes from `first` on, each half of the one before, until there are `count`.
void vkb_levels_add_sizes(struct vkb_levels *levels, struct vkb_size first, uint32_t count);

// The same from half of `above` on. It stops before a level of 1 x 1, unless that is the first.
void vkb_levels_halve(struct vkb_levels *levels, struct vkb_size above, uint32_t count);

// The row of a pass from one image to another that filters its taps in the shader: without a block
// yet; with the prefilter's block.
struct vkb_pass_row vkb_fetching_row(const struct vkb_levels *levels,
                                     const struct vkb_shader *fragment, uint32_t from, uint32_t to);
// The same for a compute shader with one invocation for each of `lines` lines.
struct vkb_pass_row vkb_row_of_lines(const struct vkb_levels *levels,
                                     const struct vkb_shader *shader, uint32_t lines, uint32_t from,
                                     uint32_t to);
struct vkb_pass_row vkb_prefilter_row(const struct vkb_levels *levels,
                                      const struct vkb_shader *fragment, uint32_t from,
                                      uint32_t to);

// A pass that downsamples with four diagonal taps at a distance of one texel: a box of 4 x 4
// texels.
void vkb_levels_box(struct vkb_levels *levels, uint32_t from, uint32_t to);

// A pass that downsamples with the pyramid's 13 taps, whose inner ones are at these distances.
void vkb_levels_reduce(struct vkb_levels *levels, double step_x, double step_y, uint32_t from,
                       uint32_t to);

// The images of all levels after the first one, and the passes that downsample the level above to
// them in this way.
void vkb_levels_reduce_rest(struct vkb_levels *levels, double step_x, double step_y);

// Adds the image down_`level` and the two passes that blur `from` into it: along rows with a
// kernel's step in texels of `from` (0: one pixel of the level), whose taps sample as `kind` says
// (of UPSAMPLE_*), then along columns of the level.
void vkb_levels_blur(struct vkb_levels *levels, uint32_t level, uint32_t from,
                     const struct vkb_kernel *kernel, enum vkb_mode kind);

// A pass that adds up shares[k] down_k of up to GATHERED_LEVELS levels, each enlarged by the kernel
// to the size of `to`.
void vkb_levels_gather(struct vkb_levels *levels, const double *shares, enum vkb_mode kernel,
                       uint32_t to);

// A pass that resizes an image bilinearly and multiplies it by a gain.
void vkb_levels_resize(struct vkb_levels *levels, uint32_t from, double gain, uint32_t to);

// The pass "bloom": enlarges the image by a kernel of UPSAMPLE_* and multiplies it by a gain.
uint32_t vkb_levels_enlarge(struct vkb_levels *levels, enum vkb_mode kernel, uint32_t from,
                            double gain);

// The passes up_N-2 ... up_0, without `last_kernel` and `gain`; the last image, which has to be
// multiplied by `levels->below`.
uint32_t vkb_levels_add_up(struct vkb_levels *levels, const struct vkb_combination *combination);

// The passes up_N-2 ... up_0 and "bloom".
uint32_t vkb_levels_combine(struct vkb_levels *levels, const struct vkb_combination *combination);

#endif
