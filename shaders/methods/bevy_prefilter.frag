#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Bevy's first downsample: 13 taps, the groups weighted by brightness but not renormalized, a
// floor, then the threshold (bevyengine/bevy v0.19.1, bloom.wgsl).
#include "lib/block.glsl"
#include "lib/sampling.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"

#include "lib/thirteen_taps.glsl"

vec4 shade()
{
    vec4 means[5] = group_means(thirteen_taps(PLACE_IN(source), vec2(params.step_x, params.step_y)));
    vec4 sum = vec4(0.0);
    for (int group = 0; group < 5; ++group) {
        vec4 part = GROUP_SHARES[group] * means[group];
        // Bevy's buffers hold no negative values. These do, and the divisor must not become 0.
        float luminance = max(dot(part.rgb, vec3(0.2126, 0.7152, 0.0722)), 0.0);
        sum += part / (1.0 + 0.25 * luminance);
    }
    sum.rgb = max(sum.rgb, vec3(1e-4));
    if (THRESHOLDED != 0) {
        float width = params.threshold * params.knee;
        sum = soft_threshold(sum, params.threshold, width, 4.0 * (width + 1e-5), 1e-5);
    }
    return stored(mask_value() * sum);
}
