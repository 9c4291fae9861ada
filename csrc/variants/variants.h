// The variants that passes run in: the same picture, in the way that a class of devices runs best.
#ifndef VKB_VARIANTS_H
#define VKB_VARIANTS_H

#include "graph/graph.h"

enum vkb_variants {
    VKB_VARIANTS_FRAGMENT,  // every pass as its method has it, drawn
    VKB_VARIANTS_CPU,
    VKB_VARIANTS_GPU,
    VKB_VARIANTS_COUNT,
};

// The variants of that name: "fragment", "cpu", "gpu", or "auto" for those that suit the device. A
// VALUE error where the name is none of these, or the device has no compute shaders that write
// images, without which there is only "fragment".
bool vkb_variants_by_name(const char *name, const struct vkb_device *device,
                          enum vkb_variants *variants, struct vkb_error *error);

// Gives each pass of a graph its variant, within what the device can do.
bool vkb_variants_choose(enum vkb_variants variants, const struct vkb_device *device,
                         struct vkb_graph *graph, struct vkb_error *error);

#endif
