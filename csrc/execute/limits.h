// The limits of the adapter that a pass given at run time has to keep. The package's own passes
// need no more than every device has.
#ifndef VKB_LIMITS_H
#define VKB_LIMITS_H

#include "graph/graph.h"
#include "vulkan/device.h"

// Fails with the limit that the pass exceeds: bindings, workgroups.
bool vkb_limits_check(const struct vkb_device *device, const struct vkb_pass_row *pass,
                      struct vkb_error *error);

#endif
