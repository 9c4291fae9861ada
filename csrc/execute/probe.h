// How the device reads texels, which Vulkan leaves open in the last bit.
#ifndef VKB_PROBE_H
#define VKB_PROBE_H

#include "execute/record.h"

// Finds out once how the device reads 8-bit levels and subnormal half floats, if a request has a
// fused pass with images of such formats. It is a submission of its own.
bool vkb_probe_texels(struct vkb_run *run, const struct vkb_request *requests,
                      uint32_t request_count, struct vkb_error *error);

#endif
