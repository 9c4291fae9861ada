#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// A filter in tiles that makes the bloom, fused with the composite, or with its MIXED cotangents.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FILTER_FINAL_BLOCK);
#include "lib/storage.glsl"
#include "lib/composite.glsl"
#include "lib/filter.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 2) uniform sampler2D scene;
#define ENDED_BINDING 3
#include "lib/ended.glsl"
layout(set = 0, binding = ENDED_TARGET) uniform writeonly image2D target;
#include "variants/filter_tile.glsl"

Window window_at(ivec2 pixel, bool along_x)
{
    return window_in(textureSize(source, 0), pixel, along_x);
}

vec4 texel_at(ivec2 texel)
{
    return fetch_clamped(source, texel);
}

vec4 own_at(ivec2 pixel)
{
    return texelFetch(scene, pixel, 0);
}

vec4 shade(vec4 own, vec4 sum, ivec2 pixel)
{
    return ended(own, as_stored(params.coarse * (sum / params.divisor), FORMAT), pixel);
}
