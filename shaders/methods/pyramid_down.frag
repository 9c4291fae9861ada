#version 450
#extension GL_GOOGLE_include_directive : require
// A level of the pyramid from the one above it by 13 taps.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"

layout(constant_id = 0) const int SAMPLING = SAMPLING_FILTER;
layout(constant_id = 1) const int FIREFLY_FILTER = 0;

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

#include "lib/thirteen_taps.glsl"

// What a group counts: less the brighter it is where fireflies are filtered (Karis 2013).
float group_share(vec3 mean, float share)
{
    if (FIREFLY_FILTER == 0)
        return share;
    return share / (1.0 + max(dot(mean, vec3(0.2126, 0.7152, 0.0722)), 0.0));
}

vec4 shade()
{
    vec3 means[5] = group_means(PLACE_IN(source));
    vec3 sum = vec3(0.0);
    float shares = 0.0;
    for (int group = 0; group < 5; ++group) {
        float share = group_share(means[group], GROUP_SHARES[group]);
        sum += share * means[group];
        shares += share;
    }
    return vec4(storable(sum / shares), 1.0);
}
