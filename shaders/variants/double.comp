#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Upsampling in the pyramid to exactly twice the size of the smaller level.
#include "lib/block.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);
#include "lib/storage.glsl"
#include "variants/pixels.glsl"
#include "variants/nested.glsl"

#define LINEAR_COLUMNS DOUBLE_LINEAR_COLUMNS
#include "variants/double.glsl"
