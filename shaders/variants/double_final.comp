#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#pragma compile packed
// The last upsampling of the bloom, to exactly twice the size, fused with the composite, or with its MIXED
// cotangents.
#include "lib/block.glsl"

UNIFORM_BLOCK(FILTER_FINAL_BLOCK);
#include "lib/storage.glsl"
#include "lib/composite.glsl"
#include "variants/pixels.glsl"

// It ends with "lib/ended.glsl".
#define FINAL
#include "variants/nested.glsl"

#define LINEAR_COLUMNS DOUBLE_FINAL_COLUMNS
#include "variants/double.glsl"
