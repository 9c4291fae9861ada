#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// A filter in tiles that makes the bloom, fused with the composite, or with its MIXED cotangents.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FILTER_FINAL_BLOCK);
#include "lib/storage.glsl"
#include "lib/composite.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 2) uniform sampler2D own;
#define ENDED_BINDING 3
#include "lib/ended.glsl"
layout(set = 0, binding = ENDED_TARGET) uniform writeonly image2D target;

#define HAS_OWN true

vec4 shade(vec4 scene, vec4 sum, ivec2 pixel)
{
    return ended(scene, as_stored(sum, FORMAT), pixel);
}

#include "variants/filter_tile.glsl"
