// Adjoint passes: each takes the cotangents of its image back to those of an image that the forward
// pass reads. All gather, so that their results have the same bits in every run, and all store
// single floats.
#ifndef VKB_ADJOINT_H
#define VKB_ADJOINT_H

#include "passes/pass.h"
#include "passes/transposes.h"

// A factor of all colours, less `by_mask` times the mask of the row; or of those that are positive.
struct vkb_share {
    double factor, by_mask;
    bool of_positive;
};

struct vkb_adjoint {
    struct vkb_graph *graph;
    struct vkb_table table;  // of all filters
    uint32_t table_image;
    uint32_t *cotangents;  // by forward image: its cotangents so far; VKB_NO_IMAGE: none
    // Images so far, of sums and others. These have the same names whether sums are wanted or not,
    // so that a plan of sums finds what that of derivatives by images has made.
    uint32_t added, summed, between;
    bool of_sums;    // what is added is for a sum by what taps have
    uint32_t moved;  // such sums so far
    uint32_t max_side;
    uint32_t mixed;  // sums of two levels so far
    struct vkb_wanted_sums sums;
    bool light;  // the threshold's sum has the derivative by the intensity
    int32_t alpha;
    bool weights;  // those by the weights of a field of kernels are wanted
    // The cotangents of the scene of a composite without a curve are a share of those that the
    // composite has. The next pass that accumulates cotangents of the scene adds them itself.
    uint32_t scene;  // VKB_NO_IMAGE: there is no such composite, or its row was added
    struct vkb_share share;
    struct vkb_pass_row scene_row;  // the composite's own pass, for the case that none adds them
    // A bloom source that is the image but for NaN and infinity: its cotangents are the image's.
    uint32_t glow, image;  // VKB_NO_IMAGE: there is none
    uint32_t lights;  // the sum of the bloom and the stages of glare; VKB_NO_IMAGE: without glare
};

// Adds the adjoint passes of a forward row, which is a copy: adding passes moves those of the
// graph.
typedef bool vkb_transpose(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                           struct vkb_error *error);

// The cotangents of what the pass writes.
uint32_t vkb_cotangent_of(const struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass);

// A row with ADJOINT_SLOTS that reads only these cotangents.
struct vkb_pass_row vkb_adjoint_row(const struct vkb_shader *shader, uint32_t cotangents);

// The row of the slopes of a pass, whose shader has the pass's parameters, its source, its mask,
// if there is one, and its cotangents.
struct vkb_pass_row vkb_slope_row(const struct vkb_adjoint *adjoint,
                                  const struct vkb_pass_row *pass, const struct vkb_shader *shader);

// Adds the row, whose result is added to the cotangents of a forward image.
bool vkb_accumulate_cotangent(struct vkb_adjoint *adjoint, const struct vkb_pass_row *row,
                              uint32_t image, struct vkb_error *error);

// Accumulates what the row computes, which is `share` of its cotangents, together with those of
// the next pass, or by vkb_end_scene().
void vkb_delay_scene(struct vkb_adjoint *adjoint, const struct vkb_pass_row *row,
                     struct vkb_share share, uint32_t image);
bool vkb_end_scene(struct vkb_adjoint *adjoint, struct vkb_error *error);

// Accumulates the transpose of a filter of an image.
bool vkb_accumulate_filter(struct vkb_adjoint *adjoint, const struct vkb_filter *filter,
                           uint32_t cotangents, uint32_t image, struct vkb_error *error);

// The same of several pictures below each other in one image of cotangents, a filter each.
bool vkb_accumulate_pictures(struct vkb_adjoint *adjoint, const struct vkb_filter *filters,
                             uint32_t count, uint32_t cotangents, uint32_t image,
                             struct vkb_error *error);

// Adds the row with a new image of `size` as its target.
bool vkb_add_adjoint_pass(struct vkb_adjoint *adjoint, struct vkb_pass_row *row,
                          struct vkb_size size, uint32_t *image, struct vkb_error *error);

// The same of a row by vkb_slope_row(), to which no other cotangents are added, and of the
// transpose of a filter.
bool vkb_add_adjoint_image(struct vkb_adjoint *adjoint, const struct vkb_pass_row *row,
                           struct vkb_size size, uint32_t *image, struct vkb_error *error);
bool vkb_filter_to_image(struct vkb_adjoint *adjoint, const struct vkb_filter *filter,
                         uint32_t cotangents, struct vkb_size size, uint32_t *image,
                         struct vkb_error *error);

// Accumulates the transpose of a filter of an image, of the row's result at the pixels of `target`.
bool vkb_accumulate_through(struct vkb_adjoint *adjoint, const struct vkb_pass_row *row,
                            const struct vkb_filter *filter, uint32_t image, uint32_t target,
                            struct vkb_error *error);

// The same of an image that the pixels of the target sample linearly.
bool vkb_accumulate_sampled(struct vkb_adjoint *adjoint, const struct vkb_pass_row *row,
                            uint32_t image, uint32_t target, struct vkb_error *error);

// Accumulates cotangents of the samples of a halo or a ghost, which a row of its slopes has, by
// their places, which are not on a grid.
bool vkb_accumulate_moved(struct vkb_adjoint *adjoint, const struct vkb_pass_row *row,
                          uint32_t source, struct vkb_error *error);

// If the pass reads a mask: accumulates the row's result by it, at the target's
// pixels.
bool vkb_accumulate_mask(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                         struct vkb_pass_row *row, struct vkb_error *error);

// Adds the row with a shader of lib/sums.glsl, and the passes that add its sums up to one pixel of
// the framebuffer `name`; below it is the sum of the squares, which tells how exact the sum is.
bool vkb_add_sum_passes(struct vkb_adjoint *adjoint, const struct vkb_pass_row *row,
                        const struct vkb_shader *shader, struct vkb_size size, const char *name,
                        struct vkb_error *error);
// Adds those of the products of cotangents and an image, for each channel.
bool vkb_add_product_sums(struct vkb_adjoint *adjoint, uint32_t cotangents, uint32_t image,
                          const char *name, struct vkb_error *error);
// Adds those by what the threshold of a pass of taps reads, if it has one and they are wanted.
bool vkb_add_threshold_sums(struct vkb_adjoint *adjoint, const struct vkb_pass_row *pass,
                            const struct vkb_pass_row *row, const struct vkb_shader *shader,
                            struct vkb_error *error);

// Whether a composite adds the bloom times the intensity, and its cotangents do not depend on it.
bool vkb_adds_bloom(const struct vkb_pass_row *composite);

// The families of passes. Of what is linear: by the filters of the row.
vkb_transpose vkb_transpose_filters;
vkb_transpose vkb_transpose_composite, vkb_transpose_threshold;
// Godot's blurs of nine taps of the frame.
vkb_transpose vkb_transpose_nine;
// Passes that are no filters.
vkb_transpose vkb_transpose_prefilter;
// Glare.
vkb_transpose vkb_transpose_streaks, vkb_transpose_flare, vkb_transpose_dirt, vkb_transpose_star;
vkb_transpose vkb_transpose_box, vkb_transpose_blender_end, vkb_transpose_sun_beams;

#endif
