#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// An upsampling to an image of the same size: multiplies each pixel.
#include "lib/block.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"
#include "variants/pixels.glsl"

vec4 made(vec4 value)
{
    return params.coarse * value;
}

#include "variants/same_size.glsl"
