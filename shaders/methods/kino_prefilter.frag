#version 450
#extension GL_GOOGLE_include_directive : require
// KinoBloom's prefilter: the median of five pixels against flicker, then the soft threshold
// (keijiro/KinoBloom @ 0a04c43fa47d, Bloom.cginc).
#include "lib/block.glsl"
#include "lib/sampling.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"

vec4 tap(float x, float y)
{
    vec4 value = sample_at(source, PLACE_IN(source), vec2(x, y), SAMPLING);
    return vec4(min(value.rgb, vec3(65000.0)), value.a);
}

// Selects with minimum and maximum only, since arithmetic would round.
vec4 middle(vec4 a, vec4 b, vec4 c)
{
    return max(min(a, b), min(max(a, b), c));
}

vec4 shade()
{
    vec4 kept = tap(0.0, 0.0);
    if (ANTI_FLICKER != 0) {
        kept = middle(kept, tap(-1.0, 0.0), tap(1.0, 0.0));
        kept = middle(kept, tap(0.0, -1.0), tap(0.0, 1.0));
    }
    if (THRESHOLDED != 0) {
        float width = params.threshold * params.knee + 1e-5;
        kept = soft_threshold(kept, params.threshold, width, 4.0 * width, 1e-5);
    }
    return stored(mask_value() * kept);
}
