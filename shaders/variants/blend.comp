#version 450
#extension GL_GOOGLE_include_directive : require
// The finished picture where scene and bloom have its size and one format: texels are loaded, past
// the sampler.
#include "lib/block.glsl"

UNIFORM_BLOCK(COMPOSITE_BLOCK);
#include "lib/storage.glsl"
#include "lib/composite.glsl"

layout(local_size_x = ROW_INVOCATIONS) in;
layout(set = 0, binding = 1, SOURCE_FORMAT) uniform readonly image2D scene;
layout(set = 0, binding = 2, SOURCE_FORMAT) uniform readonly image2D bloom;
layout(set = 0, binding = 3) uniform writeonly image2D target;

#include "variants/texels.glsl"

vec4 shade(ivec2 pixel)
{
    return finish(imageLoad(scene, pixel), imageLoad(bloom, pixel), pixel);
}
