#version 450
#extension GL_GOOGLE_include_directive : require
// URP's prefilter: one bilinear tap, a clamp, the soft threshold (Unity-Technologies/Graphics,
// com.unity.render-pipelines.universal, Bloom.shader @ 00d472fae509).
#include "lib/block.glsl"
#include "lib/sampling.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"

vec4 shade()
{
    vec4 kept = sample_at(source, PLACE_IN(source), vec2(0.0), SAMPLING);
    kept.rgb = min(kept.rgb, vec3(params.clamp_max));
    if (THRESHOLDED != 0) {
        float width = params.threshold * params.knee;
        kept = soft_threshold(kept, params.threshold, width, 4.0 * width + 1e-4, 1e-4);
    }
    return stored(mask_value() * max(kept, vec4(0.0)));
}
