#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Upsampling by any factor in one pass, which adds the share of the level itself.
#include "lib/block.glsl"
#include "lib/sampling.glsl"
#include "lib/axis.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"
#include "variants/pixels.glsl"

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, smaller);
READ_IMAGE(2, own);
WRITE_IMAGE(3);

#define HAS_OWN (ADD_OWN != 0)

uvec4 shade(uvec4 level, vec4 sum, ivec2 pixel)
{
    if (ADD_OWN != 0)
        sum += params.own * value_of(level);
    return buffer_of(sum);
}

#include "variants/upsample.glsl"
