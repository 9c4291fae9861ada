#version 450
#extension GL_GOOGLE_include_directive : require
// pygfx' first downsample: 13 taps, or the mean of their five groups weighted only by brightness;
// at least 0 (pygfx/pygfx, pygfx/renderers/wgpu/engine/bloom.py @ f5f8f72c).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"

#include "lib/thirteen_taps.glsl"

vec4 shade()
{
    vec4 means[5] = group_means(PLACE_IN(source), vec2(1.0));
    vec4 sum = vec4(0.0);
    float shares = 0.0;
    for (int group = 0; group < 5; ++group) {
        float luminance = max(dot(means[group].rgb, vec3(0.2126, 0.7152, 0.0722)), 0.0);
        float share = KARIS_AVERAGE != 0 ? 1.0 / (1.0 + luminance) : GROUP_SHARES[group];
        sum += share * means[group];
        shares += share;
    }
    return stored(mask_value() * max(sum / shares, vec4(0.0)));
}
