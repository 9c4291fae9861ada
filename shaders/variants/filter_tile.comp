#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// A filter in tiles, and the share of an image of the target's size.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 2) uniform sampler2D own;
layout(set = 0, binding = 3) uniform writeonly image2D target;

#define HAS_OWN (ADD_OWN != 0)

vec4 shade(vec4 level, vec4 sum, ivec2 pixel)
{
    if (ADD_OWN != 0)
        sum += params.own * level;
    return stored(sum);
}

#include "variants/filter_tile.glsl"
