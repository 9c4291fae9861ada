#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Downsamples a level of the pyramid with 13 taps.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

#include "lib/groups.glsl"
#include "lib/thirteen_taps.glsl"

// The 13 taps from a level of exactly twice the size, where all taps are between texels. They are
// added as two separable kernels, as in all variants of this pass (variants/halve.comp).
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
    if (SAMPLING == SAMPLING_TEXEL)
        return stored(halved());
    vec2 tap_step = vec2(params.step_x, params.step_y);
    return stored(pyramid_groups(thirteen_taps(PLACE_IN(source), tap_step)));
}
