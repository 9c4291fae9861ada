// A filter as taps along both axes, and its transpose as tables. The forward row of a family has
// the same taps as parameters; the functions that return a filter read them from there.
//
// The table of an axis has a texel (first, count, place, first of all) for each texel that the
// filter reads: the pixels that read it, where the weights of its block of ADJOINT_SIDE texels are,
// and the first pixel that reads one of these. A pixel has a texel of weights in each kernel, with
// one for each texel of the block. Edges fold back: a pixel whose taps are beyond the first or the
// last texel reads that one. Equal weights of adjacent blocks are there once.
#ifndef VKB_TAPS_H
#define VKB_TAPS_H

#include "graph/graph.h"

enum { VKB_MAX_TAPS = 2 * MAX_WEIGHTS };

// A sample at a distance from the position of a pixel, in texels, with a weight for each kernel.
struct vkb_tap {
    double offset, weights[MAX_KERNELS];
};

// What taps read beyond the first and the last pixel.
enum vkb_border {
    VKB_BORDER_NONE,  // the outermost texels
    VKB_BORDER_ZERO,  // nothing
    // Taps are pixels of the target apart, and read the samples of other pixels. Beyond the edges
    // these are the outermost one; before the first one the first two in turn, as at HDRP's first
    // level; at both edges the two of a pair in turn (Godot).
    VKB_BORDER_LAST,
    VKB_BORDER_FIRST_TWO,
    VKB_BORDER_PAIRS,
};

// How `to` pixels sample `from` texels. Pixel i is at the position origin + i step, in texels.
struct vkb_axis {
    uint32_t from, to;
    double origin, step;
    enum vkb_mode kind;  // what a tap samples at its position: UPSAMPLE_*
    enum vkb_border border;
    // Bits of next_texel() (shaders/lib/sampling.glsl): at which texels the one after it is read,
    // if there are any; whether texels are counted from the last one.
    uint32_t next;
    bool backwards;
    uint32_t first;  // where pixel 0 is in the image that the transpose reads
    uint32_t count;
    struct vkb_tap taps[VKB_MAX_TAPS];
};

// The sum over the kernels of (rows x columns), times the gain.
struct vkb_filter {
    struct vkb_axis x, y;
    uint32_t kernels;
    double gain;
};

// Makes both axes those of a pass that reads `from` and writes `to`, each with one tap at the
// position of the pixel.
void vkb_filter_begin(const struct vkb_graph *graph, uint32_t from, uint32_t to,
                      struct vkb_filter *filter);
// An axis on which pixel i is at texel `origin` + i.
void vkb_axis_move(struct vkb_axis *axis, uint32_t from, uint32_t to, double origin);
// Replaces the taps of an axis.
void vkb_axis_set(struct vkb_axis *axis, const struct vkb_tap *taps, uint32_t count);

// Leaves the taps of one kernel, as the only one.
void vkb_axis_take(struct vkb_axis *axis, uint32_t kernel);

// Lets both axes read the next texels of these bits (shaders/lib/sampling.glsl). Rows are counted
// from the bottom.
void vkb_filter_next(struct vkb_filter *filter, const float next[4]);

struct vkb_table {
    float (*texels)[4];
    size_t count, capacity;
};

// Fills the rest of the last row of the table, and gives its texels to the graph as the pixels of
// the image. On failure they are freed.
bool vkb_table_end(struct vkb_table *table, struct vkb_graph *graph, uint32_t image,
                   struct vkb_error *error);

// Whether the axis leaves an image as it is.
bool vkb_axis_is_identity(const struct vkb_axis *axis);

// About how many pixels read a texel.
double vkb_axis_readers(const struct vkb_axis *axis);

// Adds the transpose of an axis to the table. `*span` is the number of pixels whose weights a block
// has.
bool vkb_axis_transpose(const struct vkb_axis *axis, uint32_t kernels, struct vkb_table *table,
                        int *start, int *span, struct vkb_error *error);

#endif
