// The finished picture: scene and bloom, exposure, tone map, encoding, dither.

UNIFORM_BLOCK(COMPOSITE_BLOCK);
#include "lib/composite.glsl"

SAMPLED_IMAGE(SLOT_SCENE, scene);
SAMPLED_IMAGE(SLOT_BLOOM, bloom);
SAMPLED_IMAGE(SLOT_MASK, mask);

#include "lib/fullscreen.glsl"

vec4 shade()
{
    vec4 light = COMPOSITE == COMPOSITE_OFF ? vec4(0.0) : texelFetch(bloom, PIXEL, 0);
    float share = MASKED != 0 ? texelFetch(mask, PIXEL, 0).r : 1.0;
    return finish(texelFetch(scene, PIXEL, 0), light, share, PIXEL);
}
