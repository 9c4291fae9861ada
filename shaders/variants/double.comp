#version 450
#extension GL_GOOGLE_include_directive : require
// A level of the pyramid on the way up to exactly twice the size of the smaller one.
#include "lib/block.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"

layout(local_size_x = ROW_INVOCATIONS) in;
layout(set = 0, binding = 1, SOURCE_FORMAT) uniform readonly image2D smaller;
layout(set = 0, binding = 2, SOURCE_FORMAT) uniform readonly image2D own;
layout(set = 0, binding = 3) uniform writeonly image2D target;

#include "variants/double.glsl"

vec4 shade(ivec2 pixel, vec4 sum)
{
    if (ADD_OWN != 0)
        sum += params.own * imageLoad(own, pixel);
    return stored(sum);
}
