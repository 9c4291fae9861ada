#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Blender's highlights, of an image of the size of the target.
#include "lib/block.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"
#include "lib/highlights.glsl"
#include "variants/pixels.glsl"

vec4 made(vec4 value)
{
    return highlights(value);
}

#include "variants/same_size.glsl"
