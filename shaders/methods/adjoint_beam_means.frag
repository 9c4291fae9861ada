// The cotangents of what Blender's sun beams add up for a pixel: those of the mean, over the sum of the weights. A pixel
// without weights shows itself.

UNIFORM_BLOCK(SUN_BEAMS_BLOCK);
#include "lib/beam.glsl"

SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#include "lib/fullscreen.glsl"

vec4 shade()
{
    float weights = weights_of(PIXEL, textureSize(cotangents, 0));
    return texelFetch(cotangents, PIXEL, 0) / (weights > 0.0 ? weights : 1.0);
}
