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

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

vec3 tap(float x, float y)
{
    return min(sample_at(source, PLACE_IN(source), vec2(x, y), SAMPLING).rgb, vec3(65000.0));
}

// By choice alone: a sum of the three would round.
vec3 middle(vec3 a, vec3 b, vec3 c)
{
    return max(min(a, b), min(max(a, b), c));
}

vec4 shade()
{
    vec3 kept = tap(0.0, 0.0);
    if (ANTI_FLICKER != 0) {
        kept = middle(kept, tap(-1.0, 0.0), tap(1.0, 0.0));
        kept = middle(kept, tap(0.0, -1.0), tap(0.0, 1.0));
    }
    if (THRESHOLDED != 0) {
        float width = params.threshold * params.knee + 1e-5;
        kept = soft_threshold(kept, params.threshold, width, 4.0 * width, 1e-5);
    }
    return vec4(storable(kept), 1.0);
}
