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
#ifdef MIXED
layout(set = 0, binding = 3) uniform sampler2D cotangents;
layout(set = 0, binding = 4) uniform writeonly image2D target;
#define COTANGENT(pixel) texelFetch(cotangents, pixel, 0)
#else
layout(set = 0, binding = 3) uniform writeonly image2D target;
#endif
#include "lib/ended.glsl"

#define HAS_OWN true

vec4 shade(vec4 scene, vec4 sum, ivec2 pixel)
{
    return ended(scene, as_stored(sum, FORMAT), pixel);
}

#include "variants/double_tile.glsl"
