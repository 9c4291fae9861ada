// Ghosts (ghosts.frag) by the host, on devices whose images are in its memory, of half floats, with
// the same bits. The shader loads each texel of a sample by itself, and samples a ghost also where
// it shows nothing: the four passes of `blender_ghosts` take 350 ms in place of 40 (processor time
// of 1920 x 1080, lavapipe of Mesa 22.3.6, 2026-11-29).
#ifndef VKB_HOST_GHOSTS_H
#define VKB_HOST_GHOSTS_H

#include "graph/graph.h"

// Of a ghost at a column: the first one of two texels, from 0 to the width - 2, the weights of
// both, and the square of its share of the way to the border.
struct vkb_ghost_column {
    int32_t texel;
    float left, right, share;
};

struct vkb_host_ghosts {
    const struct vkb_flare_params *params;
    bool blurs_alpha;
    struct vkb_host_image source, before, target;  // `before` may have no pixels
    struct vkb_ghost_column *columns;              // of each ghost in turn
};

// Whether the host has what it takes, and the pass nothing but ghosts that fade in proportion to
// the distance.
bool vkb_host_has_ghosts(const struct vkb_pass_row *pass);

// A host pass: all pixels.
vkb_host_pass vkb_host_show_ghosts;

#endif
