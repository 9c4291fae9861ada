// Blender's sun beams: the weighted mean of the pixels between each pixel and the sun (formulas of the
// compositor of Blender 5.0).
#include "lib/sampling.glsl"

UNIFORM_BLOCK(SUN_BEAMS_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D source;

#include "lib/fullscreen.glsl"
#include "lib/fetch_inside.glsl"

uint turned(uint value, int count)
{
    return value << count | value >> (32 - count);
}

// A number of 0 to 1 from two integers: the end of Bob Jenkins' lookup3.
float hashed(uvec2 key)
{
    const int COUNTS[7] = int[](14, 11, 25, 16, 4, 14, 24);
    uvec3 mixed = 0xdeadbeefu + 8u + 13u + uvec3(0, key.yx);
    for (int i = 0; i < 7; ++i) {
        mixed.x = (mixed.x ^ mixed.y) - turned(mixed.y, COUNTS[i]);
        mixed = mixed.zxy;
    }
    return float(mixed.y) / 4294967295.0;
}

// The source at a share of its sides, with 0 outside of it.
vec4 sample_inside(vec2 share)
{
    vec2 place = share * vec2(textureSize(source, 0)) - 0.5, integer = floor(place);
    return bilinear(fetch_four_inside(source, ivec2(integer)), place - integer);
}

vec4 shade()
{
    ivec2 size = textureSize(source, 0);
    vec2 sun = vec2(params.sun_x, params.sun_y), share = (vec2(PIXEL) + 0.5) / vec2(size);
    // Blender measures from the pixel's lower left corner.
    ivec2 corner = ivec2(PIXEL.x, size.y - 1 - PIXEL.y);
    float distance = max(length(vec2(corner) - vec2(sun.x, 1.0 - sun.y) * vec2(size)), 1.0);
    vec2 towards = (sun - share) / distance;
    // The steps to the sun, and the last sample. With jitter the samples are between steps.
    int steps = min(params.most, int(distance)), last = int(params.left * float(steps));
    bool jitters = params.left < 1.0;
    float offset = jitters ? hashed(uvec2(corner)) : 0.0;
    vec4 sum = vec4(0.0);
    float weights = 0.0;

    for (int i = 0; i <= last; ++i) {
        float at = !jitters ? float(i) : params.left > 0.0 ? (float(i) + offset) / params.left : 0.0;
        vec2 place = share + at * towards;
        if (any(lessThan(place, vec2(0.0))) || any(greaterThan(place, vec2(1.0))))
            break;
        float part = 1.0 - at / float(steps), weight = part * part;
        weights += weight;
        sum += weight * sample_inside(place);
    }
    return stored(weights > 0.0 ? sum / weights : texelFetch(source, PIXEL, 0));
}
