#version 450
#extension GL_GOOGLE_include_directive : require
// The cotangents of what a ghost of number LEVELS samples.
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/sampling.glsl"
#include "lib/threshold_slope.glsl"

UNIFORM_BLOCK(FLARE_BLOCK);
#include "lib/glare.glsl"
#include "lib/above_slope.glsl"
#include "lib/flare.glsl"

layout(set = 0, binding = 2) uniform sampler2D cotangents;

#define TARGET_BINDING 5
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

vec4 shade()
{
    vec2 place = FROM_CENTRE;
    vec4 value = sample_from_centre(params.ghosts[LEVELS].w * place);
    vec4 cotangent = texelFetch(cotangents, PIXEL, 0);
    cotangent *= ghost_factor(LEVELS, place) * vignette(place);
    cotangent.rgb *= larger(vec4(params.maximum), above_threshold(value)).rgb;
    if (ALPHA != ALPHA_BLUR)
        cotangent.a = 0.0;
    return gathered(back_above_threshold(value, cotangent));
}
