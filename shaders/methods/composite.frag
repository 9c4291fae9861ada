// The finished picture: scene and bloom, exposure, tone map, encoding, dither.

#include "lib/sampling.glsl"

UNIFORM_BLOCK(COMPOSITE_BLOCK);
#include "lib/composite.glsl"

layout(set = 0, binding = 1) uniform sampler2D scene;
layout(set = 0, binding = 2) uniform sampler2D bloom;
layout(set = 0, binding = 3) uniform sampler2D mask;

#include "lib/fullscreen.glsl"

// With ENLARGED the bloom is what variants/enlarge.frag makes of the image.
vec4 bloom_at(ivec2 pixel)
{
    if (ENLARGED == 0)
        return texelFetch(bloom, pixel, 0);
    return as_stored(sample_bordered(bloom, pixel, textureSize(scene, 0), SAMPLING), FORMAT);
}

vec4 shade()
{
    vec4 light = COMPOSITE == COMPOSITE_OFF ? vec4(0.0) : bloom_at(PIXEL);
    float share = MASKED != 0 ? texelFetch(mask, PIXEL, 0).r : 1.0;
    return finish(texelFetch(scene, PIXEL, 0), light, share, PIXEL);
}
