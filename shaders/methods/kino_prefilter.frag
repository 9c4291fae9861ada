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
#include "lib/kino.glsl"

vec4 tap(float x, float y)
{
    return sample_at(source, PLACE_IN(source), vec2(x, y), SAMPLING);
}

vec4 shade()
{
    vec4 centre = tap(0.0, 0.0);
    vec4 kept = ANTI_FLICKER == 0 ? kino_bright(centre, centre, centre, centre, centre)
                                  : kino_bright(centre, tap(-1.0, 0.0), tap(1.0, 0.0),
                                                tap(0.0, -1.0), tap(0.0, 1.0));
    return stored(mask_value() * kept);
}
