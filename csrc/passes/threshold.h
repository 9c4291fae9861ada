// The threshold pass: reduces an image to the size of the bloom buffers, and applies the threshold.
#ifndef VKB_THRESHOLD_H
#define VKB_THRESHOLD_H

#include "passes/pass.h"

// How the threshold pass applies the threshold: NONE for published methods, which apply it later.
enum vkb_mode vkb_threshold_mode(const struct vkb_settings *settings);
// Whether what the stages of a published method read has passed a threshold.
bool vkb_stages_have_threshold(const struct vkb_settings *settings);

// Adds a pass that reduces `image` to the size of `glow`, applies the threshold, and multiplies by
// the mask (VKB_NO_IMAGE: none). Published methods apply their threshold and the mask later.
void vkb_add_threshold_pass(struct vkb_levels *levels, uint32_t image, uint32_t mask,
                            uint32_t glow);

// The same for the stages of glare beside a published method.
void vkb_add_stage_threshold_pass(struct vkb_levels *levels, uint32_t image, uint32_t mask,
                                  uint32_t glow);

// Whether the row is a threshold pass that reads only the texel at each pixel's own position.
bool vkb_is_threshold(const struct vkb_pass_row *pass);

#endif
