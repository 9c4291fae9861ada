#version 450
#extension GL_GOOGLE_include_directive : require
// The finished picture from the largest level of a bloom of twice its size.
#include "lib/block.glsl"

UNIFORM_BLOCK(DOUBLE_FINAL_BLOCK);
#include "lib/storage.glsl"
#include "lib/composite.glsl"

layout(local_size_x = ROW_INVOCATIONS) in;
layout(set = 0, binding = 1, SOURCE_FORMAT) uniform readonly image2D smaller;
layout(set = 0, binding = 2, SOURCE_FORMAT) uniform readonly image2D scene;
layout(set = 0, binding = 3) uniform writeonly image2D target;

#include "variants/double.glsl"

vec4 shade(ivec2 pixel, vec4 sum)
{
    return finish(imageLoad(scene, pixel), as_stored(sum, FORMAT), pixel);
}
