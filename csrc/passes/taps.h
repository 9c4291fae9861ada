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

struct vkb_table {
    float (*texels)[4];
    size_t count, capacity;
};

// Fills the rest of the last row of the table, and gives its texels to the graph as the pixels of
// the image. On failure they are freed.
bool vkb_table_end(struct vkb_table *table, struct vkb_graph *graph, uint32_t image,
                   struct vkb_error *error);

// About how many pixels read a texel.
double vkb_axis_readers(const struct vkb_axis *axis);

// Adds the transpose of an axis to the table, and finds its readers.
bool vkb_axis_transpose(struct vkb_axis *axis, uint32_t kernels, struct vkb_table *table,
                        struct vkb_error *error);
// The readers of an axis that a pass keeps.
void vkb_axis_keep(struct vkb_axis *axis);

#endif
