// The variants of passes. All have the same result; each device class runs its fastest variant.
#ifndef VKB_VARIANTS_H
#define VKB_VARIANTS_H

#include "graph/graph.h"

enum vkb_column {
    VKB_VARIANTS_FRAGMENT,  // every pass is drawn, as its method defines it
    VKB_VARIANTS_CPU,
    VKB_VARIANTS_GPU,
    VKB_VARIANTS_COUNT,
};

// A column of the table of variants, and the bits of the rows that are left out.
struct vkb_variants {
    enum vkb_column column;
    uint32_t without;
};

// The variants with this name: "fragment", "cpu", "gpu", or "auto" for those of the device's class.
// Behind it may stand variants that are left out, each after a minus: "cpu-filtered-strips". A
// VALUE error if a name is none of these, or if the device's compute shaders cannot write images
// and the variants need that. "fragment" does not.
bool vkb_variants_by_name(const char *name, const struct vkb_device *device,
                          struct vkb_variants *variants, struct vkb_error *error);

// Replaces each pass of the graph by its variant, if the device can run it.
bool vkb_variants_choose(struct vkb_variants variants, const struct vkb_device *device,
                         struct vkb_graph *graph, struct vkb_error *error);

#endif
