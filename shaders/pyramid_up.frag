#version 450
#extension GL_GOOGLE_include_directive : require
// A level of the pyramid on the way up: its own share and, upsampled, that of the smaller level.
#include "block.glsl"
#include "sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "storage.glsl"

layout(constant_id = 0) const int SAMPLING = SAMPLING_FILTER;
layout(constant_id = 1) const int ADD_OWN = 1;
layout(constant_id = 2) const int UPSAMPLE = UPSAMPLE_TENT;

layout(set = 0, binding = 1) uniform sampler2D smaller;
layout(set = 0, binding = 2) uniform sampler2D own;

layout(location = 0) out vec4 colour;

#include "upsample.glsl"

void main()
{
    vec2 position = gl_FragCoord.xy * vec2(params.ratio_x, params.ratio_y);
    vec3 sum = params.coarse * upsample(smaller, position);
    if (ADD_OWN != 0)
        sum += params.own * texelFetch(own, ivec2(gl_FragCoord.xy), 0).rgb;
    colour = vec4(storable(sum), 1.0);
}
