#version 450
#extension GL_GOOGLE_include_directive : require
// The first downsample of Blender's bloom: 13 taps in five groups of four, within which each tap is
// weighted by brightness against fireflies (formulas of the compositor of Blender 4.5).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

// A tap times its weight, and the weight.
vec4 weighted(Place place, float x, float y)
{
    vec3 value = sample_at(source, place, vec2(x, y), SAMPLING).rgb;
    float weight = 1.0 / (1.0 + max(max(value.r, max(value.g, value.b)), 0.0));
    return vec4(weight * value, weight);
}

vec3 mean(vec4 a, vec4 b, vec4 c, vec4 d)
{
    vec4 sum = a + b + c + d;
    return sum.rgb / sum.a;
}

vec4 shade()
{
    Place place = PLACE_IN(source);
    vec4 a = weighted(place, -2.0, -2.0), b = weighted(place, 0.0, -2.0);
    vec4 c = weighted(place, 2.0, -2.0), d = weighted(place, -2.0, 0.0);
    vec4 e = weighted(place, 0.0, 0.0), f = weighted(place, 2.0, 0.0);
    vec4 g = weighted(place, -2.0, 2.0), h = weighted(place, 0.0, 2.0);
    vec4 i = weighted(place, 2.0, 2.0);
    vec3 inner = mean(weighted(place, -1.0, -1.0), weighted(place, 1.0, -1.0),
                      weighted(place, -1.0, 1.0), weighted(place, 1.0, 1.0));
    vec3 outer = mean(a, b, d, e) + mean(b, c, e, f) + mean(d, e, g, h) + mean(e, f, h, i);
    return vec4(storable(0.5 * inner + 0.125 * outer), 1.0);
}
