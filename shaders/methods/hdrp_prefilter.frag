#version 450
#extension GL_GOOGLE_include_directive : require
// HDRP's prefilter: the centre and four diagonal taps, weighted against fireflies (Karis 2013;
// Unity-Technologies/Graphics, com.unity.render-pipelines.high-definition, BloomPrefilter.compute @
// 2309d2c2fde8).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"

vec4 shade()
{
    const vec2 offsets[5] = vec2[](vec2(0.0, 0.0), vec2(0.9, -0.4), vec2(-0.9, 0.4), vec2(0.4, 0.9),
                                   vec2(-0.4, -0.9));
    Place place = PLACE_IN(source);
    vec4 sum = vec4(0.0);
    float shares = 0.0;
    for (int i = 0; i < 5; ++i) {
        vec4 value = sample_at(source, place, offsets[i], SAMPLING);
        float luminance = dot(value.rgb, vec3(0.2126729, 0.7151522, 0.0721750));
        float share = 1.0 / (1.0 + max(luminance, 0.0));
        sum += share * value;
        shares += share;
    }
    return stored(mask_value() * (sum / shares));
}
