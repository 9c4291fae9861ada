// Transposes of axes, each computed once, and the table of a graph, which has those of its filters.
#ifndef VKB_TRANSPOSES_H
#define VKB_TRANSPOSES_H

#include "graph/graph.h"

// The derivatives by fields that may be wanted, which are sums:
// - composite: by what the composite reads;
// - intensity: one of the composite, unless the threshold's sum has it;
// - threshold: by what a threshold reads;
// - shares: by the shares of a level and a smaller one;
// - stages: by the intensities of the bloom and of the stages of glare;
// - levels: by factors of the channels of the levels that one pass adds up;
// - enlarging, reducing: by factors of the distances of taps in passes that enlarge a level, and in
//   others;
// - weight: by each weight of blurs;
// - colour: by factors of the channels of the first level.
#define VKB_SUMS(SUM) \
    SUM(composite) \
    SUM(intensity) \
    SUM(threshold) \
    SUM(shares) \
    SUM(stages) \
    SUM(levels) \
    SUM(enlarging) \
    SUM(reducing) \
    SUM(weight) \
    SUM(colour)

struct vkb_wanted_sums {
#define VKB_SUM_MEMBER(name) bool name;
    VKB_SUMS(VKB_SUM_MEMBER)
#undef VKB_SUM_MEMBER
};

struct vkb_transposed;

// The transposes that were used last, the newest at the end, with the hashes of their descriptions:
// a plan looks for dozens among hundreds. The owner sees to it that one thread at a time uses them.
struct vkb_transposes {
    struct {
        uint64_t hash;
        struct vkb_transposed *transposed;
    } *kept;
    size_t count, capacity;
    size_t bytes;
    size_t built;  // so far
};

void vkb_transposes_destroy(struct vkb_transposes *transposes);

// The texels of the transposes of all axes, one after the other, and the hash of their
// descriptions. Axes with the same transpose share its texels, such as those of a blur that is
// repeated.
struct vkb_table {
    struct vkb_transposes *transposes;
    float (*texels)[4];
    size_t count, capacity;
    uint64_t hash;
    struct {
        size_t number;  // of the transpose
        size_t start;   // its first texel
    } *parts;
    size_t part_count, part_capacity;
};

// Destroying an empty table is safe.
void vkb_table_destroy(struct vkb_table *table);

// Adds the transpose of an axis to the table, unless it is there, and sets the axis' readers.
bool vkb_axis_transpose(struct vkb_axis *axis, uint32_t kernels, struct vkb_table *table,
                        struct vkb_error *error);

// Fills the rest of the last row of the table, and gives its texels to the graph as the pixels of
// the image.
bool vkb_table_end(struct vkb_table *table, struct vkb_graph *graph, uint32_t image,
                   struct vkb_error *error);

#endif
