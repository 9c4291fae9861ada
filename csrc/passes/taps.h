// The transpose of a filter (graph/filter.h) as tables.
//
// The table of an axis has a texel (first, count, place, first of all) for each texel that the
// filter reads: the pixels that read it, where the weights of its block of ADJOINT_SIDE texels are,
// and the first pixel that reads one of these. A pixel has a texel of weights in each kernel, with
// one for each texel of the block. Edges fold back: a pixel whose taps are beyond the first or the
// last texel reads that one. Equal weights of adjacent blocks are there once.
#ifndef VKB_TAPS_H
#define VKB_TAPS_H

#include "graph/graph.h"

// The transpose of an axis: its table, whose places count from its first texel, and its readers.
struct vkb_transposed {
    double *description;  // of the axis (passes/transposes.c)
    size_t described;     // numbers of it
    size_t number;        // that no other transpose of the renderer has had
    float (*texels)[4];
    size_t count;
    struct vkb_readers readers;
};

// Whether a position is a texel's centre, which is met with roundings.
bool vkb_is_centred(double position);

// About how many pixels read a texel.
double vkb_axis_readers(const struct vkb_axis *axis);

// Computes the table and the readers. On failure the caller frees what is there.
bool vkb_axis_build(const struct vkb_axis *axis, uint32_t kernels, struct vkb_transposed *found,
                    struct vkb_error *error);
// The readers of an axis that a pass keeps.
extern const struct vkb_readers vkb_kept_readers;

#endif
