// The cotangents of an image that is multiplied by a weight of each pixel.

UNIFORM_BLOCK(WEIGH_BLOCK);

SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);
SAMPLED_IMAGE(SLOT_WEIGHTS, weights);

#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

vec4 shade()
{
    return gathered(texelFetch(weights, PIXEL, 0)[params.channel] * texelFetch(cotangents, PIXEL, 0));
}
