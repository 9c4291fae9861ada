#version 450
#extension GL_GOOGLE_include_directive : require
// The first downsample of Blender's bloom: 13 taps in five groups of four. Within a group, brighter
// taps weigh less, against fireflies (formulas of the compositor of Blender 4.5).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

// A tap multiplied by its weight, and the weight.
struct Weighted {
    vec4 value;
    float weight;
};

Weighted weighted(Place place, float x, float y)
{
    vec4 value = sample_at(source, place, vec2(x, y), SAMPLING);
    float weight = 1.0 / (1.0 + max(max(value.r, max(value.g, value.b)), 0.0));
    return Weighted(weight * value, weight);
}

vec4 mean(Weighted a, Weighted b, Weighted c, Weighted d)
{
    return (a.value + b.value + c.value + d.value) / (a.weight + b.weight + c.weight + d.weight);
}

vec4 shade()
{
    Place place = PLACE_IN(source);
    Weighted a = weighted(place, -2.0, -2.0), b = weighted(place, 0.0, -2.0);
    Weighted c = weighted(place, 2.0, -2.0), d = weighted(place, -2.0, 0.0);
    Weighted e = weighted(place, 0.0, 0.0), f = weighted(place, 2.0, 0.0);
    Weighted g = weighted(place, -2.0, 2.0), h = weighted(place, 0.0, 2.0);
    Weighted i = weighted(place, 2.0, 2.0);
    vec4 inner = mean(weighted(place, -1.0, -1.0), weighted(place, 1.0, -1.0),
                      weighted(place, -1.0, 1.0), weighted(place, 1.0, 1.0));
    vec4 outer = mean(a, b, d, e) + mean(b, c, e, f) + mean(d, e, g, h) + mean(e, f, h, i);
    return stored(0.5 * inner + 0.125 * outer);
}
