#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#pragma compile packed
// A filter that makes the bloom, fused with the composite, or with its MIXED cotangents.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FILTER_FINAL_BLOCK);
#include "lib/storage.glsl"
#include "lib/composite.glsl"
#include "variants/pixels.glsl"

// It ends with "lib/ended.glsl".
#define FINAL
#include "variants/nested.glsl"

vec4 seen(uvec4 raw)
{
    return value_of(raw);
}

#include "variants/filter.glsl"
