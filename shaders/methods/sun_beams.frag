#version 450
#extension GL_GOOGLE_include_directive : require
// Blender's sun beams: the weighted mean of the pixels between each pixel and the sun (formulas of the
// compositor of Blender 5.0).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(SUN_BEAMS_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

uint turned(uint value, int count)
{
    return value << count | value >> (32 - count);
}

// A number of 0 to 1 from two integers: the end of Bob Jenkins' lookup3.
float hashed(uvec2 key)
{
    const uint START = 0xdeadbeefu + 8u + 13u;
    uint a = START + key.x, b = START + key.y, c = START;
    c = (c ^ b) - turned(b, 14);
    a = (a ^ c) - turned(c, 11);
    b = (b ^ a) - turned(a, 25);
    c = (c ^ b) - turned(b, 16);
    a = (a ^ c) - turned(c, 4);
    b = (b ^ a) - turned(a, 14);
    c = (c ^ b) - turned(b, 24);
    return float(c) / 4294967295.0;
}

vec4 fetch_inside(ivec2 texel)
{
    bool inside = all(greaterThanEqual(texel, ivec2(0)))
               && all(lessThan(texel, textureSize(source, 0)));
    return inside ? texelFetch(source, texel, 0) : vec4(0.0);
}

// The source at a share of its sides, with 0 outside of it.
vec4 sample_inside(vec2 share)
{
    vec2 place = share * vec2(textureSize(source, 0)) - 0.5, integer = floor(place);
    ivec2 texel = ivec2(integer);
    vec4 four[4] = vec4[4](fetch_inside(texel), fetch_inside(texel + ivec2(1, 0)),
                           fetch_inside(texel + ivec2(0, 1)), fetch_inside(texel + ivec2(1, 1)));
    return bilinear(four, place - integer);
}

vec4 shade()
{
    ivec2 size = textureSize(source, 0);
    vec2 sun = vec2(params.sun_x, params.sun_y), share = (vec2(PIXEL) + 0.5) / vec2(size);
    // Blender measures from the pixel's lower left corner.
    ivec2 corner = ivec2(PIXEL.x, size.y - 1 - PIXEL.y);
    vec2 away = vec2(corner) - vec2(sun.x, 1.0 - sun.y) * vec2(size);
    float distance = max(length(away), 1.0);
    int steps = min(params.most, int(distance));
    vec2 towards = (sun - share) / distance;
    bool jittered = params.left < 1.0;
    float offset = jittered ? hashed(uvec2(corner)) : 0.0;
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    int count = int(params.left * float(steps));
    for (int i = 0; i <= count; ++i) {
        float at = jittered ? params.left > 0.0 ? (float(i) + offset) / params.left : 0.0 : float(i);
        vec2 place = share + at * towards;
        if (any(lessThan(place, vec2(0.0))) || any(greaterThan(place, vec2(1.0))))
            break;
        float part = 1.0 - at / float(steps);
        weights += part * part;
        sum += part * part * sample_inside(place);
    }
    return stored(weights > 0.0 ? sum / weights : texelFetch(source, PIXEL, 0));
}
