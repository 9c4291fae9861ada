// The composite: the pass that combines scene and bloom into the final image.
#ifndef VKB_COMPOSITE_H
#define VKB_COMPOSITE_H

#include "passes/pass.h"

// The inputs of the last pass: the scene, the bloom (VKB_NO_IMAGE: none), and the part of the scene
// that is the source of the bloom: all of it, the part under the mask (VKB_NO_IMAGE: no mask), or
// nothing (`apart`).
struct vkb_composite_source {
    uint32_t scene, bloom, mask;
    bool apart;  // the bloom was made from another image
    bool lit;    // it is the sum of the bloom, times the intensity, and the glare
    enum vkb_alpha alpha;
};

// Adds the last pass. It writes the framebuffer "final" in this format, with the scene's channels.
void vkb_add_composite_pass(struct vkb_levels *levels, const struct vkb_composite_source *source,
                            enum vkb_format format);

// Adds a pass that only combines scene and bloom, into an image of single floats that is no
// framebuffer. Exposure, curve and encoding of the settings are left to a composite of it without a
// bloom.
uint32_t vkb_add_combining_pass(struct vkb_levels *levels,
                                const struct vkb_composite_source *source);

// Whether the row is a composite that adds a bloom.
bool vkb_is_composite(const struct vkb_pass_row *pass);
// The same, or the row that takes cotangents back through exposure and curves of one, its last
// image.
bool vkb_ends_bloom(const struct vkb_pass_row *pass);

#endif
