// Combines scene and bloom, then applies exposure, tone map, encoding and dither. The including
// shader's block has the parameters intensity, exposure and noise_seed.

#include "lib/dither.glsl"
#include "lib/lab.glsl"
#include "lib/tonemap.glsl"

// The light of the bloom, or with glare of both, which the image then has the sum of.
vec3 light_of(vec3 b)
{
    return LIT != 0 ? b : params.intensity * b;
}

// `share` is the part of the scene from which the bloom was made.
vec3 composite(vec3 s, vec3 b, float share)
{
    if (COMPOSITE == COMPOSITE_MIX)
        return LIT != 0 ? s + (b - params.intensity * share * s)
                                  : s + (b - share * s) * params.intensity;
    if (COMPOSITE == COMPOSITE_SCREEN) {
        // 1 - (1 - s)(1 - b), expanded: differences from 1 lose the precision of dark values. Godot
        // has a white in place of 1, and scenes above it.
        if (EXPOSED_SCENE == 0)
            s = clamp(s, 0.0, 1.0);
        return s + (params.white - s) * clamp(light_of(b) / params.white, 0.0, 1.0);
    }
    if (COMPOSITE == COMPOSITE_REPLACE)
        return light_of(b);
    // Of pmndrs/postprocessing: above 1 it adds, less 1.
    if (COMPOSITE == COMPOSITE_UNCLAMPED_SCREEN)
        return s + light_of(b) - min(s * light_of(b), vec3(1.0));
    if (COMPOSITE == COMPOSITE_LIGHTNESS_SCREEN)
        return lightness_screen(s, light_of(b).r);
    if (COMPOSITE == COMPOSITE_ADD_TO_POSITIVE)
        return max(s, vec3(0.0)) + light_of(b);
    if (COMPOSITE == COMPOSITE_ADD)
        return s + light_of(b);
    return s;
}

// What the brightest light makes of it. Limited from below, since infinity times 0 is NaN.
vec3 softest(vec3 s)
{
    vec3 low = max(s, -1e6), dark = ((16.0 * low - 12.0) * low + 4.0) * low;
    return mix(sqrt(max(s, 0.0)), dark, lessThanEqual(s, vec3(0.25)));
}

vec3 softest_slope(vec3 s)
{
    vec3 low = max(s, -1e6), dark = (48.0 * low - 24.0) * low + 4.0;
    return mix(0.5 / sqrt(max(s, 0.25)), dark, lessThanEqual(s, vec3(0.25)));
}

vec3 soft_light(vec3 s, vec3 light)
{
    return mix(s + clamp(light, 0.0, 1.0) * (softest(s) - s), s, greaterThan(s, vec3(1.0)));
}

// The light that the alpha shows (the setting `alpha`).
float alpha_light(vec4 bloom)
{
    return light_of(vec3(ALPHA == ALPHA_MAX ? largest(bloom.rgb) : bloom.a)).r;
}

// The alpha of the finished picture before it is stored.
float mixed_alpha(float alpha, vec4 bloom)
{
    float light = clamp(alpha_light(bloom), 0.0, 1.0);
    if (ALPHA == ALPHA_KEEP)
        return alpha;
    return ALPHA == ALPHA_MAX ? max(alpha, light) : alpha + (1.0 - alpha) * light;
}

// NaN and infinity of the scene stay in their own pixels and channels: some curves would change
// them, and curves that mix channels would spread them. (With linear texels finished() keeps them.)
vec4 encoded(vec4 scene, vec4 bloom, vec3 toned, ivec2 pixel)
{
    vec3 result = apply_encoding(toned, ENCODING, params.reference_white);
    if (DITHER != 0)
        result = dithered(result, pixel, params.noise_seed);
    result = storable(result);
#ifndef LINEAR_TEXELS
    result = mix(scene.rgb, result, is_finite(scene.rgb));
#endif
    float alpha = storable(vec3(mixed_alpha(scene.a, bloom))).r;
    return vec4(result, ALPHA != ALPHA_KEEP && is_finite(scene.aaa).r ? alpha : scene.a);
}

vec4 finish(vec4 scene, vec4 bloom, float share, ivec2 pixel)
{
    float exposure = exp2(params.exposure);
    vec3 colour = finite_or_zero(scene.rgb), light = bloom.rgb;
    // Godot's exposure comes before the composite, its soft light after the tone map (godotengine/godot,
    // tonemap.glsl @ 001c8c9c24dc).
    if (EXPOSED_SCENE != 0)
        colour *= exposure;
    if (COMPOSITE == COMPOSITE_SOFT_LIGHT) {
        vec3 toned = apply_tonemap(colour, TONEMAP);
        return encoded(scene, bloom, soft_light(toned, apply_tonemap(light_of(light), TONEMAP)), pixel);
    }
    vec3 result = composite(colour, light, share);
    if (EXPOSED_SCENE == 0)
        result *= exposure;
    return encoded(scene, bloom, apply_tonemap(result, TONEMAP), pixel);
}
