#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The last upsampling of the bloom, to exactly twice the size, fused with the composite, for GPUs.
#include "lib/block.glsl"

UNIFORM_BLOCK(FILTER_FINAL_BLOCK);
#include "lib/storage.glsl"
#include "lib/composite.glsl"

layout(set = 0, binding = 1) uniform sampler2D smaller;
layout(set = 0, binding = 2) uniform sampler2D own;
#define ENDED_BINDING 3
#include "lib/ended.glsl"
layout(set = 0, binding = ENDED_TARGET) uniform writeonly image2D target;

#define HAS_OWN true

vec4 shade(vec4 scene, vec4 sum, ivec2 pixel)
{
    return ended(scene, as_stored(sum, FORMAT), pixel);
}

#include "variants/double_tile.glsl"
