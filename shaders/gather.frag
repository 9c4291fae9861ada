#version 450
#extension GL_GOOGLE_include_directive : require
// Levels of several sizes into one image, each enlarged on its own, with its weight.
#include "block.glsl"
#include "sampling.glsl"
#include "cubic.glsl"

UNIFORM_BLOCK(GATHER_BLOCK);
#include "storage.glsl"

layout(constant_id = 0) const int SAMPLING = SAMPLING_FILTER;
layout(constant_id = 1) const int UPSAMPLE = UPSAMPLE_LINEAR;
layout(constant_id = 2) const int LEVELS = MAX_GATHERED;

layout(set = 0, binding = 1) uniform sampler2D level_0;
layout(set = 0, binding = 2) uniform sampler2D level_1;
layout(set = 0, binding = 3) uniform sampler2D level_2;
layout(set = 0, binding = 4) uniform sampler2D level_3;
layout(set = 0, binding = 5) uniform sampler2D level_4;
layout(set = 0, binding = 6) uniform sampler2D level_5;
layout(set = 0, binding = 7) uniform sampler2D level_6;

layout(location = 0) out vec4 colour;

vec3 share(sampler2D image, int level)
{
    float weight = params.shares[level >> 2][level & 3];
    if (level >= LEVELS || weight == 0.0)
        return vec3(0.0);
    vec2 position = gl_FragCoord.xy * (vec2(textureSize(image, 0)) / vec2(params.width, params.height));
    if (UPSAMPLE == UPSAMPLE_CUBIC)
        return weight * sample_cubic(image, position);
    return weight * sample_at(image, position, SAMPLING).rgb;
}

void main()
{
    vec3 sum = share(level_0, 0) + share(level_1, 1) + share(level_2, 2) + share(level_3, 3)
             + share(level_4, 4) + share(level_5, 5) + share(level_6, 6);
    colour = vec4(storable(sum), 1.0);
}
