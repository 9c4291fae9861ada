// A linear filter as data, in doubles: what a linear pass computes, whatever shader it has. Rows
// refer to filters that the graph owns. Parameter blocks, variants and transposes are made from
// these (passes/filter.h, passes/taps.h).
#ifndef VKB_FILTER_DATA_H
#define VKB_FILTER_DATA_H

#include "graph/params.h"

#include <stdbool.h>

enum { VKB_MAX_TAPS = 3 * MAX_KERNELS };

// A symmetric kernel along an axis: the weights w0.. of a tap in the middle and of those on both
// sides of it, which are `step` apart, or `offsets` steps from the middle.
struct vkb_kernel {
    uint32_t count;
    bool placed;  // by offsets
    double step;  // in texels of the source
    double weights[MAX_WEIGHTS], offsets[MAX_OFFSETS];
};

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

// Of the transpose of an axis: where its weights begin in the table (passes/taps.h), and which
// pixels read the texels.
struct vkb_readers {
    int32_t start;   // below 0: the axis stays as it is
    int32_t span;    // pixels whose weights each block of texels has; 0: blocks differ
    int32_t most;    // of a texel; MAX_READERS + 1: those of a texel begin before those before it
    int32_t usual;   // the most of a texel in the middle half
    int32_t window;  // that has all of them, in the ratio of sides (WINDOW_FIRST); 0: none has
    // Whether all texels that are not near an edge have the same weights in their windows of one
    // kernel, but for rounding: those of even texels, then those of odd ones. (Where tiles take
    // these is told in adjoint_filter_tile.comp.)
    bool repeats;
    float inner[FILTER_TILE_WINDOW / 2][4];
};

// How `to` pixels sample `from` texels. Pixel i is at the position origin + i step, in texels.
struct vkb_axis {
    uint32_t from, to;
    double origin, step;
    enum vkb_mode kind;  // what a tap samples at its position: UPSAMPLE_*
    bool slopes;         // of UPSAMPLE_LINEAR: taps have derivatives by a factor of their offsets
    enum vkb_border border;
    // Bits of next_texel() (shaders/lib/sampling.glsl): at which texels the one after it is read,
    // if there are any; whether texels are counted from the last one.
    uint32_t next;
    bool backwards;
    uint32_t first;  // where pixel 0 is in the image that the transpose reads
    uint32_t count;
    struct vkb_tap taps[VKB_MAX_TAPS];
    struct vkb_kernel kernel;  // in place of the taps, if it has weights
    // What it was before its kernel was moved to texels, if the graph keeps that; else NULL.
    const struct vkb_axis *unmoved;
    struct vkb_readers readers;  // of a row of the transpose
};

// The sum over the kernels of (rows x columns), times the gain.
struct vkb_filter {
    struct vkb_axis x, y;
    uint32_t kernels;
    double gain, divisor;
    bool enlarges;  // a level, whatever the size of the target is
};

struct vkb_graph;

// Makes both axes those of a pass that reads `from` and writes `to`, each with one tap at the
// position of the pixel.
void vkb_filter_begin(const struct vkb_graph *graph, uint32_t from, uint32_t to,
                      struct vkb_filter *filter);

// An axis on which pixel i is at texel `origin` + i.
void vkb_axis_move(struct vkb_axis *axis, uint32_t from, uint32_t to, double origin);
// Makes the positions of an axis those of a ratio of sides alone, 2, 1 or 1/2 texels apart, in a
// source that begins at its texel `first`. Beyond the edges are the outermost texels.
void vkb_axis_align(struct vkb_axis *axis, double step, int32_t first);
// The texel at which the source begins for the positions, and whether it is moved at all.
int32_t vkb_axis_first(const struct vkb_axis *axis);
bool vkb_axis_is_moved(const struct vkb_axis *axis);
// Replaces the taps of an axis.
void vkb_axis_set(struct vkb_axis *axis, const struct vkb_tap *taps, uint32_t count);

// The taps of an axis, whether it has a kernel or not.
uint32_t vkb_axis_count(const struct vkb_axis *axis);
struct vkb_tap vkb_axis_tap(const struct vkb_axis *axis, uint32_t number);

// Leaves the taps of one kernel, as the only one.
void vkb_axis_take(struct vkb_axis *axis, uint32_t kernel);

// Lets both axes read the next texels of these bits (shaders/lib/sampling.glsl). Rows are counted
// from the bottom.
void vkb_filter_next(struct vkb_filter *filter, const float next[4]);

// Whether sides, or positions, are in a simple ratio: EXACT_*; 0: they are not.
int32_t vkb_ratio_of(uint32_t source, uint32_t target);
int32_t vkb_axis_ratio(const struct vkb_axis *axis);

// Whether taps sample linearly beside the positions of the pixels.
bool vkb_axis_has_distances(const struct vkb_axis *axis);

// Whether the axis leaves an image as it is.
bool vkb_axis_is_identity(const struct vkb_axis *axis);

#endif
