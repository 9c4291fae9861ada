// An image times a weight of each pixel, and what is added to it.

UNIFORM_BLOCK(WEIGH_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_WEIGHTS, weights);
SAMPLED_IMAGE(SLOT_ADDED, added);

#include "lib/fullscreen.glsl"

vec4 shade()
{
    vec4 weighted = texelFetch(weights, PIXEL, 0)[params.channel] * texelFetch(source, PIXEL, 0);
    return stored(ADDS_IMAGE != 0 ? texelFetch(added, PIXEL, 0) + weighted : weighted);
}
