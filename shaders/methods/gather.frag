#version 450
#extension GL_GOOGLE_include_directive : require
// Levels of several sizes into one image, each enlarged bilinearly on its own, with its weight.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(GATHER_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D level_0;
layout(set = 0, binding = 2) uniform sampler2D level_1;
layout(set = 0, binding = 3) uniform sampler2D level_2;
layout(set = 0, binding = 4) uniform sampler2D level_3;
layout(set = 0, binding = 5) uniform sampler2D level_4;

#define TARGET_BINDING 6
#include "lib/fullscreen.glsl"

vec3 share(sampler2D image, float weight)
{
    return weight * sample_at(image, PLACE_IN(image), vec2(0.0), SAMPLING).rgb;
}

vec4 shade()
{
    vec3 sum = share(level_0, params.shares[0].x) + share(level_1, params.shares[0].y)
             + share(level_2, params.shares[0].z) + share(level_3, params.shares[0].w)
             + share(level_4, params.shares[1].x);
    return vec4(storable(sum), 1.0);
}
