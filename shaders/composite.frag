#version 450
#extension GL_GOOGLE_include_directive : require
// The finished picture: scene and bloom, exposure, tone map, encoding, dither.
#include "block.glsl"
#include "dither.glsl"
#include "finite.glsl"
#include "tonemap.glsl"

UNIFORM_BLOCK(COMPOSITE_BLOCK);
#include "storage.glsl"

layout(constant_id = 0) const int COMPOSITE = COMPOSITE_ADD;
layout(constant_id = 1) const int TONEMAP = TONEMAP_NONE;
layout(constant_id = 2) const int ENCODING = ENCODING_NONE;
layout(constant_id = 3) const int DITHER = 0;

layout(set = 0, binding = 1) uniform sampler2D scene;
layout(set = 0, binding = 2) uniform sampler2D bloom;

layout(location = 0) out vec4 colour;

vec3 composite(vec3 s, vec3 b)
{
    if (COMPOSITE == COMPOSITE_MIX)
        return s + (b - s) * params.intensity;
    if (COMPOSITE == COMPOSITE_SCREEN)
        return 1.0 - (1.0 - clamp(s, 0.0, 1.0)) * (1.0 - clamp(params.intensity * b, 0.0, 1.0));
    return s + params.intensity * b;
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 source = texelFetch(scene, pixel, 0);
    // Curves that mix the channels must not spread one channel's NaN to the others.
    vec3 result = finite_or_zero(source.rgb);
    if (COMPOSITE != COMPOSITE_OFF)
        result = composite(result, texelFetch(bloom, pixel, 0).rgb);
    result = apply_encoding(apply_tonemap(result * exp2(params.exposure), TONEMAP), ENCODING);
    if (DITHER != 0)
        result = dithered(result, pixel, params.noise_seed);
    // NaN and infinity of the source stay at their own pixels, whatever the curve makes of them.
    colour = vec4(mix(source.rgb, storable(result), is_finite(source.rgb)), source.a);
}
