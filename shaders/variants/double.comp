#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Upsampling in the pyramid to exactly twice the size of the smaller level.
#include "lib/block.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);
#include "lib/storage.glsl"
#include "variants/pixels.glsl"

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, smaller);
READ_IMAGE(2, own);
WRITE_IMAGE(3);

#define HAS_OWN (ADD_OWN != 0)
#define WORDS_COLUMNS DOUBLE_WORDS_COLUMNS

uvec4 shade(uvec4 level, vec4 sum, ivec2 pixel)
{
    if (ADD_OWN != 0)
        sum += params.own * value_of(level);
    return buffer_of(sum);
}

#include "variants/double.glsl"
