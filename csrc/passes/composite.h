// The composite: scene and bloom to the finished picture.
#ifndef VKB_COMPOSITE_H
#define VKB_COMPOSITE_H

#include "passes/pass.h"

// What the last pass reads: the scene, the bloom (VKB_NO_IMAGE: none), and what of the scene the
// bloom came of: all of it, what the mask (VKB_NO_IMAGE: none) leaves, or nothing.
struct vkb_composite_source {
    uint32_t scene, bloom, mask;
    bool apart;  // the bloom came of another image
    enum vkb_alpha alpha;
};

// The last pass: to the framebuffer "final", of that format and with the scene's channels.
bool vkb_add_composite(const struct vkb_settings *settings,
                       const struct vkb_composite_source *source, enum vkb_format format,
                       struct vkb_graph *graph, struct vkb_error *error);

// Whether a row is of that pass and adds a bloom.
bool vkb_is_composite(const struct vkb_pass_row *pass);

// Gives the row of a fused pass, whose block is B, all that the composite has. A block without
// COMPOSITE_ROWS does not compile.
#define VKB_TAKE_COMPOSITE(row, B, composite) \
    do { \
        struct vkb_pass_row *const to = (row); \
        const struct vkb_pass_row *const from = (composite); \
        to->constants = from->constants; \
        COMPOSITE_ROWS(B, VKB_TAKE_COMPOSITE_SETTING, VKB_TAKE_COMPOSITE_INPUT) \
    } while (0)
#define VKB_TAKE_COMPOSITE_SETTING(B, name)     to->params.B.name = from->params.composite.name;
#define VKB_TAKE_COMPOSITE_INPUT(B, type, name) VKB_TAKE_COMPOSITE_SETTING(B, name)

#endif
