#version 450
#extension GL_GOOGLE_include_directive : require
// A level of the pyramid from the one above it by 13 taps: five 2 x 2 groups, the middle one half
// of the weight (Jimenez, "Next Generation Post Processing in Call of Duty: Advanced Warfare",
// SIGGRAPH 2014).
#include "block.glsl"
#include "sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "storage.glsl"

layout(constant_id = 0) const int SAMPLING = SAMPLING_FILTER;
layout(constant_id = 1) const int FIREFLY_FILTER = 0;

layout(set = 0, binding = 1) uniform sampler2D source;

layout(location = 0) out vec4 colour;

vec3 tap(Place place, float x, float y)
{
    return sample_at(source, place, vec2(x, y), SAMPLING).rgb;
}

// What a group counts: less the brighter it is where fireflies are filtered (Karis 2013).
float group_share(vec3 mean, float share)
{
    if (FIREFLY_FILTER == 0)
        return share;
    return share / (1.0 + max(dot(mean, vec3(0.2126, 0.7152, 0.0722)), 0.0));
}

void main()
{
    Place place = place_in(source, ivec2(gl_FragCoord.xy),
                           ivec2(params.target_width, params.target_height));
    // Rows of taps at -2, 0, 2, left to right; then the four inner ones.
    vec3 a = tap(place, -2.0, -2.0), b = tap(place, 0.0, -2.0), c = tap(place, 2.0, -2.0);
    vec3 d = tap(place, -2.0, 0.0), e = tap(place, 0.0, 0.0), f = tap(place, 2.0, 0.0);
    vec3 g = tap(place, -2.0, 2.0), h = tap(place, 0.0, 2.0), i = tap(place, 2.0, 2.0);
    vec3 inner = tap(place, -1.0, -1.0) + tap(place, 1.0, -1.0) + tap(place, -1.0, 1.0)
               + tap(place, 1.0, 1.0);
    vec3 means[5] = vec3[](0.25 * inner, 0.25 * (a + b + d + e), 0.25 * (b + c + e + f),
                           0.25 * (d + e + g + h), 0.25 * (e + f + h + i));
    vec3 sum = vec3(0.0);
    float shares = 0.0;
    for (int group = 0; group < 5; ++group) {
        float share = group_share(means[group], group == 0 ? 0.5 : 0.125);
        sum += share * means[group];
        shares += share;
    }
    colour = vec4(storable(sum / shares), 1.0);
}
