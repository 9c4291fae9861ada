// The finished picture: scene and bloom, exposure, tone map, encoding, dither.

UNIFORM_BLOCK(COMPOSITE_BLOCK);
#include "lib/composite.glsl"

layout(set = 0, binding = 1) uniform sampler2D scene;
layout(set = 0, binding = 2) uniform sampler2D bloom;
layout(set = 0, binding = 3) uniform sampler2D mask;

#include "lib/fullscreen.glsl"

vec4 shade()
{
    vec4 light = COMPOSITE == COMPOSITE_OFF ? vec4(0.0) : texelFetch(bloom, PIXEL, 0);
    float share = MASKED != 0 ? texelFetch(mask, PIXEL, 0).r : 1.0;
    return finish(texelFetch(scene, PIXEL, 0), light, share, PIXEL);
}
