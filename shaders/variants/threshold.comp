#version 450
#extension GL_GOOGLE_include_directive : require
// The threshold pass if the bloom buffers have the size of the image. Texels are loaded directly,
// without the sampler.
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(THRESHOLD_BLOCK);
#include "lib/storage.glsl"

layout(local_size_x = ROW_INVOCATIONS) in;
layout(set = 0, binding = 1, SOURCE_FORMAT) uniform readonly image2D image;
layout(set = 0, binding = 2) uniform writeonly image2D target;

#include "variants/texels.glsl"

vec4 shade(ivec2 pixel)
{
    vec4 colour = finite_or_zero(imageLoad(image, pixel));
    vec4 kept = apply_threshold(colour, THRESHOLD_MODE, params.threshold, params.knee);
    return stored(kept);
}
