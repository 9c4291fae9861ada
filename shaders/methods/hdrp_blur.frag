#version 450
#extension GL_GOOGLE_include_directive : require
// HDRP's binomial filter of order 8 in one direction. It reduces the image along this direction,
// and treats borders as HDRP does (Unity-Technologies/Graphics,
// com.unity.render-pipelines.high-definition, BloomBlur.compute @ 0e4ca4d79b2c). Before the first
// texel of the first level, the first two texels alternate. Before the first texel of other levels,
// and after the last pixel, the outermost sample is repeated.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"
#include "lib/hdrp.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

const ivec2 along = DIRECTION == DIRECTION_HORIZONTAL ? ivec2(1, 0) : ivec2(0, 1);

// The position of a pixel of the target. SAMPLING_TEXEL: the source is twice as large along the
// direction, which needs no division.
Place place_of(ivec2 pixel, ivec2 size)
{
    if (SAMPLING == SAMPLING_TEXEL)
        return Place(pixel * (1 + along), 0.5 * vec2(along));
    return place_in(source, pixel, size);
}

// The source at a pixel of the target, or at one outside of its border.
vec4 sample_pixel(ivec2 pixel, ivec2 size)
{
    bvec2 before = lessThan(pixel, ivec2(0));
    if (FIRST != 0)
        return fetch_clamped(source, mix(pixel, pixel & 1, before));
    Place place = place_of(clamp(pixel, ivec2(0), size - 1), size);
    place = Place(mix(place.texel, ivec2(0), before), mix(place.part, vec2(0.0), before));
    if (SAMPLING == SAMPLING_FILTER)
        return sample_at(source, place, vec2(0.0), SAMPLING);
    // Across the direction, source and target have the same size.
    return blended(fetch_clamped(source, place.texel), fetch_clamped(source, place.texel + along),
                   dot(place.part, vec2(along)));
}

vec4 shade()
{
    ivec2 size = ivec2(params.target_width, params.target_height);
    vec4 sum = vec4(0.0);
    for (int tap = -HDRP_RADIUS; tap <= HDRP_RADIUS; ++tap)
        sum += HDRP_WEIGHTS[tap + HDRP_RADIUS] * sample_pixel(PIXEL + tap * along, size);
    return stored(sum);
}
