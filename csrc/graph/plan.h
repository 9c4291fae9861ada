// Which passes of a graph a run needs for its outputs, and which of two that stand for each other.
#ifndef VKB_PLAN_H
#define VKB_PLAN_H

#include "graph/graph.h"
#include "run/readback.h"

// The runs of the same source before and after one; NULL: there is none.
struct vkb_neighbours {
    const struct vkb_graph *previous, *next;
};

// Marks the passes that the outputs need, and the images that those passes read or write, in arrays
// of the graph's counts. `current` says which passes have nothing to do. An alternative is taken in
// place of the pass before it where fewer passes have to run for it; but not where a neighbour
// shares all that it spares, for another pass: what a sequence shares is made once, then only what
// changes.
bool vkb_plan(const struct vkb_graph *graph, const struct vkb_neighbours *neighbours,
              const struct vkb_output *outputs, uint32_t output_count, const bool *current,
              bool *needed, bool *wanted, struct vkb_error *error);

#endif
