#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// A filter in tiles, and the share of an image of the target's size. With FROM_IMAGE it reads the image itself in
// place of the threshold pass's result.
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/sampling.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);
#include "lib/storage.glsl"
#include "lib/filter.glsl"
#include "variants/thresholded.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 2) uniform sampler2D level;
layout(set = 0, binding = 3) uniform writeonly image2D target;
#include "variants/filter_tile.glsl"

Window window_at(ivec2 pixel, bool along_x)
{
    return window_in(textureSize(source, 0), pixel, along_x);
}

vec4 texel_at(ivec2 texel)
{
    return thresholded(fetch_clamped(source, texel));
}

vec4 own_at(ivec2 pixel)
{
    return ADD_OWN != 0 ? texelFetch(level, pixel, 0) : vec4(0.0);
}

vec4 shade(vec4 own, vec4 sum, ivec2 pixel)
{
    sum = params.coarse * (sum / params.divisor);
    if (ADD_OWN != 0)
        sum += params.own * own;
    return stored(sum);
}
