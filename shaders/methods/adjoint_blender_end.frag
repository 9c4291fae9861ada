#version 450
#extension GL_GOOGLE_include_directive : require
// The cotangents of the light at the end of Blender's glare (blender_end.frag), at the pixels of the
// bloom.
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/sampling.glsl"
#include "lib/threshold_slope.glsl"

UNIFORM_BLOCK(BLENDER_END_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 2) uniform sampler2D cotangents;

#define TARGET_BINDING 5
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

vec3 back_saturated(vec3 value, vec3 brought)
{
    float most = max(value.r, max(value.g, value.b)), least = min(value.r, min(value.g, value.b));
    float spread = most - least, sum = dot(brought, vec3(1.0));
    vec3 at_most = shares_of_brightest(value), at_least = shares_of_brightest(-value);
    if (most <= 0.0 || spread == 0.0)
        return at_most * sum;
    // most - saturation (most - value)
    if (params.saturation * spread <= most)
        return params.saturation * brought + at_most * ((1.0 - params.saturation) * sum);
    // (value - least) most / spread
    float scale = most / spread, by_scale = dot(brought, value - least) / (spread * spread);
    return scale * brought - at_least * (scale * sum) + (at_least * most - at_most * least) * by_scale;
}

vec4 shade()
{
    Place place = PLACE_IN(source);
    vec4 value = fetch_bilinear(source, place.texel, place.part);
    vec4 brought = params.factors[0] * texelFetch(cotangents, PIXEL, 0);
    return gathered(vec4(back_saturated(value.rgb, brought.rgb), ALPHA == ALPHA_BLUR ? brought.a : 0.0));
}
