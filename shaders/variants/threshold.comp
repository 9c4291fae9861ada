#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The threshold pass if the bloom buffers have the size of the image.
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(THRESHOLD_BLOCK);
#include "lib/storage.glsl"
#include "variants/pixels.glsl"

vec4 made(vec4 value)
{
    return apply_threshold(finite_or_zero(value), THRESHOLD_MODE, params.threshold, params.knee);
}

#define LOAD_CHANNELS SOURCE_CHANNELS
#include "variants/same_size.glsl"
