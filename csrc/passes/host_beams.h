// Blender's sun beams (sun_beams.frag) by the host, on devices whose images are in its memory:
// pixel by pixel, with the samples of a pixel next to each other in vectors. Beams of pixels near
// each other see the same texels, so tiles of pixels are done one after the other.
#ifndef VKB_HOST_BEAMS_H
#define VKB_HOST_BEAMS_H

#include "graph/graph.h"

// The sides of the tiles.
enum { VKB_BEAM_TILE = 32 };

struct vkb_host_beams {
    const struct vkb_sun_beams_params *params;
    bool jittered, blurs_alpha;
    struct vkb_host_image source;  // with a texel of zeros around the image
    struct vkb_host_image dark;    // no pixels with jitter
    struct vkb_host_image target;
};

// A host pass: the beams of all pixels.
vkb_host_pass vkb_host_sun_beams;

#endif
