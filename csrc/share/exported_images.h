// Images that come from memory that CUDA shares, and framebuffers that go there.
#ifndef VKB_EXPORTED_H
#define VKB_EXPORTED_H

#include "execute/record.h"

// Fails with a value error if a dispatch cannot read the image: its rows are too far apart.
bool vkb_exported_check(const struct vkb_device *device, const struct vkb_input *input,
                        struct vkb_error *error);

// The bytes of scratch memory that an input or an output needs.
VkDeviceSize vkb_exported_input_scratch(const struct vkb_device *device,
                                        const struct vkb_input *input);
VkDeviceSize vkb_exported_output_scratch(const struct vkb_device *device,
                                         const struct vkb_output *output);

// Whether a dispatch reads the output's image, so that no copy is needed before.
bool vkb_exported_dispatches(const struct vkb_device *device, const struct vkb_output *output);

// Records the copy of the input to its image, if it is to be sent, and the count of NaN and
// infinity.
bool vkb_exported_record_input(struct vkb_run *run, struct vkb_staged_input *staged,
                               struct vkb_error *error);

// Orders the submission after what CUDA fills, and before what it reads. Where the device has no
// timelines, this waits until CUDA has filled the memory of the inputs.
bool vkb_exported_begin(const struct vkb_run *run, const struct vkb_request *requests,
                        uint32_t request_count, struct vkb_sync *order, struct vkb_error *error);
// After the submission: the outputs know the point at which they are complete.
void vkb_exported_end(const struct vkb_request *requests, uint32_t request_count,
                      const struct vkb_sync *order);

// Records what follows the copy of an output by its sink: it is handed over to CUDA.
bool vkb_exported_record_output(struct vkb_run *run, struct vkb_image *image,
                                const struct vkb_output *output, struct vkb_error *error);

#endif
