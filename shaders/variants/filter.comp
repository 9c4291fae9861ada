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

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, source);
READ_IMAGE(2, own);
WRITE_IMAGE(3);

#include "variants/thresholded.glsl"

#define HAS_OWN (ADD_OWN != 0)

vec4 seen(uvec4 raw)
{
    return thresholded(value_of(raw));
}

uvec4 shade(uvec4 level, vec4 sum, ivec2 pixel)
{
    if (ADD_OWN != 0)
        sum += params.own * value_of(level);
    return buffer_of(sum);
}

#include "variants/filter.glsl"
