#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// A filter of an image of any size (lib/filter.glsl), and the share of an image of the target's size.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 2) uniform sampler2D own;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/filter.glsl"
#include "lib/filter_image.glsl"

// The pyramid's 13 taps from a level of exactly twice the size, where all taps are between texels. They
// are added as two separable kernels, as in all variants of this pass (variants/halve.comp).
vec4 halved()
{
    vec4 sum = vec4(0.0);
    for (int row = 0; row < 6; ++row) {
        vec4 texels[6];
        for (int i = 0; i < 6; ++i)
            texels[i] = fetch_clamped(source, 2 * PIXEL + ivec2(i, row) - 2);
        vec4 inner = texels[2] + texels[3];
        vec4 four = inner + texels[1] + texels[4];
        vec4 six = four + inner + texels[0] + texels[5];
        sum += six / (row == 2 || row == 3 ? 64.0 : 128.0)
             + (row == 0 || row == 5 ? vec4(0.0) : four / 32.0);
    }
    return sum;
}

vec4 shade()
{
    if (EXACT == EXACT_HALF)
        return stored(halved());
    vec4 sum = params.coarse * (filtered(source) / params.divisor);
    if (ADD_OWN != 0)
        sum += params.own * texelFetch(own, PIXEL, 0);
    return stored(sum);
}
