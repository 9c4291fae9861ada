// Whether an adapter can run a graph: the formats of its images, its memory, and the limits that a
// pass given at run time has to keep. The package's own passes need no more than every device has.
#ifndef VKB_LIMITS_H
#define VKB_LIMITS_H

#include "graph/graph.h"
#include "vulkan/device.h"

// The first fails with what the adapter cannot do; without a renderer it knows no limits. The
// second fails if the adapter cannot render to the image, the third if images of `needed` bytes
// exceed its memory.
bool vkb_limits_check_graph(const struct vkb_device *device, const struct vkb_graph *graph,
                            struct vkb_error *error);
bool vkb_limits_check_image(const struct vkb_device *device, const struct vkb_image_row *row,
                            struct vkb_error *error);
bool vkb_limits_check_memory(const struct vkb_device *device, const struct vkb_graph *graph,
                             uint64_t needed, struct vkb_error *error);

#endif
