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

// The formulas, each with its slope. `share` is the part of the scene from which the bloom was made.

// The cotangents of the scene's colours and of the light, i b.
struct Parts {
    vec3 scene, light;
};

vec3 mixed_light(vec3 s, vec3 b, float share)
{
    return LIT != 0 ? s + (b - params.intensity * share * s) : s + (b - share * s) * params.intensity;
}

Parts back_mixed_light(vec3 s, float share, vec3 by)
{
    return Parts((1.0 - params.intensity * share) * by, by);
}

// 1 - (1 - s)(1 - b), expanded: differences from 1 lose the precision of dark values. Godot has a white in place of 1,
// and scenes above it.
vec3 screen(vec3 s, vec3 light)
{
    if (EXPOSED_SCENE == 0)
        s = clamp(s, 0.0, 1.0);
    return s + (params.white - s) * clamp(light / params.white, 0.0, 1.0);
}

Parts back_screen(vec3 s, vec3 light, vec3 by)
{
    vec3 share = light / params.white;
    vec3 by_light = (params.white - s) / params.white * inside(share, 0.0, 1.0);
    if (EXPOSED_SCENE != 0)
        return Parts(by * (1.0 - clamp(share, 0.0, 1.0)), by * by_light);
    return Parts(by * (1.0 - clamp(light, 0.0, 1.0)) * inside(s, 0.0, 1.0),
                 by * (1.0 - clamp(s, 0.0, 1.0)) * inside(light, 0.0, 1.0));
}

// Of pmndrs/postprocessing: above 1 it adds, less 1.
vec3 unclamped_screen(vec3 s, vec3 light)
{
    return s + light - min(s * light, vec3(1.0));
}

Parts back_unclamped_screen(vec3 s, vec3 light, vec3 by)
{
    return Parts(by * (1.0 - light * below(s * light, 1.0)), by * (1.0 - s * below(s * light, 1.0)));
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

// Of tone-mapped scenes and lights.
vec3 soft_light(vec3 s, vec3 light)
{
    return mix(s + clamp(light, 0.0, 1.0) * (softest(s) - s), s, greaterThan(s, vec3(1.0)));
}

Parts back_soft_light(vec3 s, vec3 light, vec3 by)
{
    vec3 lit = below(s, 1.0);
    return Parts(by * (1.0 + lit * clamp(light, 0.0, 1.0) * (softest_slope(s) - 1.0)),
                 by * lit * (softest(s) - s) * inside(light, 0.0, 1.0));
}

// (A soft light comes after the tone map.)
vec3 composite(vec3 s, vec3 b, float share)
{
    if (COMPOSITE == COMPOSITE_MIX)
        return mixed_light(s, b, share);
    if (COMPOSITE == COMPOSITE_SCREEN)
        return screen(s, light_of(b));
    if (COMPOSITE == COMPOSITE_REPLACE)
        return light_of(b);
    if (COMPOSITE == COMPOSITE_UNCLAMPED_SCREEN)
        return unclamped_screen(s, light_of(b));
    if (COMPOSITE == COMPOSITE_LIGHTNESS_SCREEN)
        return lightness_screen(s, light_of(b).r);
    if (COMPOSITE == COMPOSITE_ADD_TO_POSITIVE)
        return max(s, vec3(0.0)) + light_of(b);
    if (COMPOSITE == COMPOSITE_ADD)
        return s + light_of(b);
    return s;
}

Parts back_composite_formula(vec3 s, vec3 light, float share, vec3 by)
{
    if (COMPOSITE == COMPOSITE_MIX)
        return back_mixed_light(s, share, by);
    if (COMPOSITE == COMPOSITE_SCREEN)
        return back_screen(s, light, by);
    if (COMPOSITE == COMPOSITE_REPLACE)
        return Parts(vec3(0.0), by);
    if (COMPOSITE == COMPOSITE_UNCLAMPED_SCREEN)
        return back_unclamped_screen(s, light, by);
    if (COMPOSITE == COMPOSITE_LIGHTNESS_SCREEN) {
        vec4 both = back_lightness_screen(s, light.r, by);
        return Parts(both.rgb, vec3(both.a, 0.0, 0.0));
    }
    return Parts(COMPOSITE == COMPOSITE_ADD_TO_POSITIVE ? by * above(s, 0.0) : by, by);
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
