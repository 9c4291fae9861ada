#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// A filter, and the share of an image of the target's size. With FROM_IMAGE it reads the image itself in
// place of the threshold pass's result.
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/sampling.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);
#include "lib/storage.glsl"
#include "variants/pixels.glsl"
#include "variants/nested.glsl"
#include "variants/thresholded.glsl"

vec4 seen(uvec4 raw)
{
    return thresholded(value_of(raw));
}

#include "variants/filter.glsl"
