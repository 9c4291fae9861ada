#version 450
#extension GL_GOOGLE_include_directive : require
// The cotangents of a convolution's glow, from those of what its filter of bright colours makes of it
// (prefiltered() of padded.glsl).
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/threshold_slope.glsl"

UNIFORM_BLOCK(ADJOINT_BRIGHT_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 2) uniform sampler2D cotangents;

#define TARGET_BINDING 5
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

vec3 back_prefiltered(vec3 colour, vec3 cotangent)
{
    const vec3 weights = vec3(0.2126, 0.7152, 0.0722);
    float luminance = dot(colour, weights);
    if (luminance < params.prefilter_min)
        return cotangent;
    float line =
        params.prefilter_factor * (luminance - params.prefilter_min) + params.prefilter_min;
    float held = max(luminance, 1e-30);
    float ratio = luminance > 0.0 ? min(line, params.prefilter_max) / held : params.prefilter_factor;
    float slope = larger(vec4(params.prefilter_max), vec4(line)).x * params.prefilter_factor;
    vec3 above = ratio * cotangent + weights * (dot(cotangent, colour) * (slope - ratio) / held);
    return mix(cotangent, above, larger(vec4(luminance), vec4(params.prefilter_min)).x);
}

vec4 shade()
{
    vec4 cotangent = texelFetch(cotangents, PIXEL, 0);
    cotangent.rgb = back_prefiltered(texelFetch(source, PIXEL, 0).rgb, cotangent.rgb);
    return gathered(vec4(cotangent.rgb, ALPHA == ALPHA_BLUR ? cotangent.a : 0.0));
}
