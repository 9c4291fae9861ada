// Shared by methods with levels of decreasing size: the images of a chain, its downsampling rows,
// and its upsampling rows.
#ifndef VKB_LEVELS_H
#define VKB_LEVELS_H

#include "passes/pass.h"

struct vkb_levels {
    const struct vkb_settings *settings;
    const struct vkb_bloom_source *source;
    struct vkb_graph *graph;
    struct vkb_size sizes[MAX_LEVELS];
    uint32_t downs[MAX_LEVELS];
    uint32_t count;
};

// How levels become the bloom: up_k = own[k] down_k + coarse[k] U(up_k+1) with
// up_N-1 = smallest * down_N-1, bloom = gain * V(up_0).
struct vkb_combination {
    enum vkb_mode kernel, last_kernel;  // U and V, of UPSAMPLE_*
    double radius_x, radius_y;          // of a tent, in texels of the smaller level
    bool width_step;                    // the radii are shares of the smaller level's width
    bool target_step;                   // instead, one texel of the larger level
    double own[MAX_LEVELS], coarse[MAX_LEVELS];
    double smallest, gain;
};

// The same `own` and `coarse` for all levels.
struct vkb_combination vkb_combine(enum vkb_mode kernel, double own, double coarse);

// Half of a size, floored, but at least 1 on each side.
struct vkb_size vkb_halved(struct vkb_size size);

// Appends sizes until there are `count`, each half of the one before. The chain ends before a level
// of 1 x 1, unless it is the first.
void vkb_levels_halve(struct vkb_levels *levels, struct vkb_size above, uint32_t count);

// An image in the format of the bloom buffers. `number` replaces a %u in the name.
bool vkb_levels_image(const struct vkb_levels *levels, const char *name, uint32_t number,
                      struct vkb_size size, uint32_t *image, struct vkb_error *error);

// The same as an intermediate image, which is not a framebuffer.
bool vkb_levels_step(const struct vkb_levels *levels, const char *name, uint32_t number,
                     struct vkb_size size, uint32_t *image, struct vkb_error *error);

// A pass from one image to another, its taps filtered by hand, with no block yet; and with the
// pyramid's or the prefilter's.
struct vkb_pass_row vkb_fetching_row(const struct vkb_levels *levels, enum vkb_shader fragment,
                                     uint32_t from, uint32_t to);
struct vkb_pass_row vkb_pyramid_row(const struct vkb_levels *levels, enum vkb_shader fragment,
                                    uint32_t from, uint32_t to);
struct vkb_pass_row vkb_prefilter_row(const struct vkb_levels *levels, enum vkb_shader fragment,
                                      uint32_t from, uint32_t to);

// Has a prefilter multiply what it writes by the mask of the source, if there is one.
void vkb_mask_prefilter(const struct vkb_levels *levels, struct vkb_pass_row *row);

// The 13 taps of a pyramid's way down, fireflies filtered or not.
struct vkb_pass_row vkb_down_row(const struct vkb_levels *levels, bool firefly_filter,
                                 uint32_t from, uint32_t to);

// Whether a row is of those taps from a level of exactly twice the size, or of an upsampling to
// exactly twice the size: then it needs integer texels alone. (Where fireflies are filtered, groups
// of taps have weights of their own.)
bool vkb_halves(const struct vkb_pass_row *pass);
bool vkb_doubles(const struct vkb_pass_row *pass);

// A separable blur on the way down.
struct vkb_kernel {
    const float *weights;  // w0..
    uint32_t count;
    double step_x;  // distance of the taps of the first, horizontal, pass in texels of its source;
                    // 0: one pixel of the level
};

// Adds the image down_`level` and the two passes that blur `from` into it.
bool vkb_levels_blur(struct vkb_levels *levels, uint32_t level, uint32_t from,
                     const struct vkb_kernel *kernel, struct vkb_error *error);

// A pass that gathers shares[k] down_k of up to GATHERED_LEVELS levels, each enlarged by that
// kernel to the size of `to`.
bool vkb_levels_gather(const struct vkb_levels *levels, const double *shares, enum vkb_mode kernel,
                       uint32_t to, struct vkb_error *error);

// The image "bloom", of the final size.
bool vkb_levels_bloom(const struct vkb_levels *levels, uint32_t *bloom, struct vkb_error *error);

// The pass "bloom": the image enlarged bilinearly, times a gain.
bool vkb_levels_enlarge(const struct vkb_levels *levels, uint32_t from, double gain,
                        uint32_t *bloom, struct vkb_error *error);

// The passes up_N-2 ... up_0 and "bloom".
bool vkb_levels_combine(const struct vkb_levels *levels, const struct vkb_combination *combination,
                        uint32_t *bloom, struct vkb_error *error);

#endif
