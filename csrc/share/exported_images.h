// Images that come from memory that CUDA shares, and framebuffers that go there.
#ifndef VKB_EXPORTED_H
#define VKB_EXPORTED_H

#include "execute/record.h"

// The usage of an image of that format whose pixels go to exported memory.
VkImageUsageFlags vkb_exported_usage(enum vkb_format format);

// Fails with a value error if a dispatch cannot read the image: its rows are too far apart.
bool vkb_exported_check(const struct vkb_device *device, const struct vkb_input *input,
                        struct vkb_error *error);

// Records the copy of the input to its image, if it is to be sent, and the count of NaN and
// infinity.
bool vkb_exported_record_input(struct vkb_run *run, struct vkb_staged_input *staged,
                               struct vkb_error *error);

// Takes what a submission that is over has counted, for later ones.
void vkb_exported_take_counts(const struct vkb_device *device, struct vkb_frame *frame,
                              struct vkb_submission *submission);

// Begins the copies that CUDA is to make to the inputs, and lets the submission wait for them. Call
// it before the recording, which takes less time than the copies. It also finds out whether an
// image is finite, which the recording asks.
bool vkb_exported_fill(struct vkb_run *run, const struct vkb_frame_source *source,
                       struct vkb_error *error);

#endif
