#version 450
#extension GL_GOOGLE_include_directive : require
// Adds up the pixels of an image, block by block.
#include "lib/block.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"
#include "lib/sums.glsl"

vec4 value(ivec2 pixel)
{
    return texelFetch(source, pixel, 0);
}

SUM_OF_BLOCK(value)

vec4 shade()
{
    return sum_of_block(textureSize(source, 0));
}
