#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Upsampling in the pyramid: adds the share of the level itself and that of the upsampled smaller
// level.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"
#include "lib/doubling.glsl"

layout(set = 0, binding = 1) uniform sampler2D smaller;
layout(set = 0, binding = 2) uniform sampler2D own;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/upsample.glsl"

// The tent, or one bilinear tap, for a level of exactly twice the size of the smaller one.
vec4 doubled()
{
    ivec2 first = (PIXEL + 1) / 2 - 2;
    vec4 rows[4];
    for (int y = 0; y < 4; ++y) {
        vec4 texels[4];
        for (int x = 0; x < 4; ++x)
            texels[x] = fetch_clamped(smaller, first + ivec2(x, y));
        rows[y] = four(texels[0], texels[1], texels[2], texels[3], (PIXEL.x & 1) == 1);
    }
    return four(rows[0], rows[1], rows[2], rows[3], (PIXEL.y & 1) == 1);
}

vec4 shade()
{
    vec4 level = SAMPLING == SAMPLING_TEXEL
                   ? doubled()
                   : upsample(smaller, ivec2(UPSAMPLE), vec2(params.step_x, params.step_y));
    vec4 sum = params.coarse * level;
    if (ADD_OWN != 0)
        sum += params.own * texelFetch(own, PIXEL, 0);
    return stored(sum);
}
