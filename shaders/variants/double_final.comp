#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The last upsampling of the bloom, to exactly twice the size, fused with the composite.
#include "lib/block.glsl"

UNIFORM_BLOCK(FILTER_FINAL_BLOCK);
#include "lib/storage.glsl"
#include "lib/composite.glsl"
#include "variants/pixels.glsl"

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, smaller);
READ_IMAGE(2, own);
#define ENDED_BINDING 3
#include "lib/ended.glsl"
WRITE_IMAGE(ENDED_TARGET);

#define HAS_OWN true
#define WORDS_COLUMNS DOUBLE_FINAL_COLUMNS

uvec4 shade(uvec4 scene, vec4 sum, ivec2 pixel)
{
    return ended(scene, as_stored(sum, FORMAT), pixel);
}

#include "variants/double.glsl"
