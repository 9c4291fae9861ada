#version 450
#extension GL_GOOGLE_include_directive : require
// Downsamples a level with four diagonal taps at a distance of one texel: a box of 4 x 4 texels.
// The firefly filter weights the taps by brightness and renormalizes (Karis 2013; keijiro/KinoBloom
// @ 0a04c43fa47d, Bloom.cginc).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

float tap_share(vec4 value)
{
    if (FIREFLY_FILTER == 0)
        return 1.0;
    return 1.0 / (1.0 + max(max(value.r, max(value.g, value.b)), 0.0));
}

vec4 shade()
{
    const vec2 corners[4] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(-1, 1), vec2(1, 1));
    Place place = PLACE_IN(source);
    vec4 sum = vec4(0.0);
    float shares = 0.0;
    for (int corner = 0; corner < 4; ++corner) {
        vec4 value = sample_at(source, place, corners[corner], SAMPLING);
        float share = tap_share(value);
        sum += share * value;
        shares += share;
    }
    return stored(sum / shares);
}
