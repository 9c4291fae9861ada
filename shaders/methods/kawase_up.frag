#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Upsampling of dual Kawase: four axial taps at a distance of one texel of the smaller level times
// the offset, and four diagonal taps at half that distance with twice the weight (source:
// kawase_down.frag).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(KAWASE_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D smaller;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"
#include "lib/upsample.glsl"

vec4 shade()
{
    const ivec2 rows = ivec2(UPSAMPLE_PAIR, UPSAMPLE_LINEAR), columns = rows.yx;
    vec4 axial = upsample(smaller, rows, vec2(params.offset, 0.0))
               + upsample(smaller, columns, vec2(0.0, params.offset));
    vec4 diagonal = upsample(smaller, ivec2(UPSAMPLE_PAIR), vec2(0.5 * params.offset));
    return stored((axial + 2.0 * diagonal) / 12.0);
}
