// The finished picture: scene and bloom, exposure, tone map, encoding, dither.

#include "lib/sampling.glsl"

UNIFORM_BLOCK(COMPOSITE_BLOCK);
#include "lib/composite.glsl"

SAMPLED_IMAGE(SLOT_SCENE, scene);
SAMPLED_IMAGE(SLOT_BLOOM, bloom);
SAMPLED_IMAGE(SLOT_MASK, mask);

#include "lib/fullscreen.glsl"

// With SAMPLES_LINES the bloom is what variants/enlarge.frag makes of the image.
vec4 bloom_at(ivec2 pixel)
{
    if (SAMPLES_LINES == 0)
        return texelFetch(bloom, pixel, 0);
    return as_stored(sample_bordered(bloom, pixel, textureSize(scene, 0), SAMPLING), FORMAT);
}

vec4 shade()
{
    vec4 light = COMPOSITE == COMPOSITE_OFF ? vec4(0.0) : bloom_at(PIXEL);
    float share = MASKED != 0 ? texelFetch(mask, PIXEL, 0).r : 1.0;
    return finish(texelFetch(scene, PIXEL, 0), light, share, PIXEL);
}
