#version 450
#extension GL_GOOGLE_include_directive : require
// The finished picture as Godot blends it: the exposure comes before the composite, soft light after
// the tone map (godotengine/godot, tonemap.glsl @ 001c8c9c24dc).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(GODOT_FINAL_BLOCK);
#include "lib/storage.glsl"
#include "lib/composite.glsl"

layout(set = 0, binding = 1) uniform sampler2D scene;
layout(set = 0, binding = 2) uniform sampler2D bloom;
layout(set = 0, binding = 3) uniform sampler2D mask;

#define TARGET_BINDING 4
#include "lib/fullscreen.glsl"

vec3 soft_light(vec3 s, vec3 light)
{
    // Limited from below, since infinity times 0 is NaN.
    vec3 low = max(s, -1e6);
    vec3 dark = ((16.0 * low - 12.0) * low + 4.0) * low;
    vec3 full = mix(sqrt(max(s, 0.0)), dark, lessThanEqual(s, vec3(0.25)));
    return mix(s + clamp(light, 0.0, 1.0) * (full - s), s, greaterThan(s, vec3(1.0)));
}

vec3 blend(vec3 s, vec3 bloom_light, float share)
{
    vec3 light = light_of(bloom_light);
    if (COMPOSITE == COMPOSITE_SOFT_LIGHT)
        return soft_light(apply_tonemap(s, TONEMAP), apply_tonemap(light, TONEMAP));
    vec3 sum = s + light;
    if (COMPOSITE == COMPOSITE_MIX)
        sum = mixed(s, bloom_light, share);
    if (COMPOSITE == COMPOSITE_REPLACE)
        sum = light;
    if (COMPOSITE == COMPOSITE_SCREEN) {
        vec3 part = clamp(light / params.white, 0.0, 1.0);
        sum = s + (params.white - s) * part;
    }
    return apply_tonemap(sum, TONEMAP);
}

vec4 shade()
{
    vec4 pixel = texelFetch(scene, PIXEL, 0);
    vec3 exposed = finite_or_zero(pixel.rgb) * exp2(params.exposure);
    vec4 light = texelFetch(bloom, PIXEL, 0);
    float share = MASKED != 0 ? texelFetch(mask, PIXEL, 0).r : 1.0;
    return encoded(pixel, light, blend(exposed, light.rgb, share), PIXEL);
}
