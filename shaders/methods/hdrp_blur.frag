#version 450
#extension GL_GOOGLE_include_directive : require
// HDRP's binomial filter of order 8 in one direction. It reduces the image along this direction,
// and treats borders as HDRP does (Unity-Technologies/Graphics,
// com.unity.render-pipelines.high-definition, BloomBlur.compute @ 0e4ca4d79b2c). Before the first
// texel of the first level, the first two texels alternate. Before the first texel of other levels,
// and after the last pixel, the outermost sample is repeated.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

// The position of a pixel of the target, or of one outside of its border.
Place place_of(ivec2 pixel, ivec2 size)
{
    if (FIRST != 0)
        return Place(mix(pixel, pixel & 1, lessThan(pixel, ivec2(0))), vec2(0.0));
    Place place = place_in(source, clamp(pixel, ivec2(0), size - 1), size);
    bvec2 before = lessThan(pixel, ivec2(0));
    return Place(mix(place.texel, ivec2(0), before), mix(place.part, vec2(0.0), before));
}

vec4 shade()
{
    const float weights[9] = float[](0.00390625, 0.03125, 0.109375, 0.21875, 0.2734375, 0.21875,
                                     0.109375, 0.03125, 0.00390625);
    ivec2 size = ivec2(params.target_width, params.target_height);
    ivec2 along = DIRECTION == DIRECTION_HORIZONTAL ? ivec2(1, 0) : ivec2(0, 1);
    vec4 sum = vec4(0.0);
    for (int tap = 0; tap < 9; ++tap) {
        Place place = place_of(PIXEL + (tap - 4) * along, size);
        sum += weights[tap] * sample_at(source, place, vec2(0.0), SAMPLING);
    }
    return stored(sum);
}
