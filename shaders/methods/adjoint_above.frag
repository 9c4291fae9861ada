// The cotangents of what a stage of glare reads, from those of what is above the stage's threshold.

UNIFORM_BLOCK(STREAKS_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 2) uniform sampler2D cotangents;

#define ADDED_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

vec4 shade()
{
    vec4 cotangent = texelFetch(cotangents, PIXEL, 0);
    if (ALPHA != ALPHA_BLUR)
        cotangent.a = 0.0;
    return gathered(back_part_above(texelFetch(source, PIXEL, 0), cotangent, params.threshold));
}
