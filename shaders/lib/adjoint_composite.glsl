// Cotangents through the composite: of its scene and its bloom. The including shader has composite.glsl
// with its parameters, and where_finite.glsl.
#include "lib/tonemap_slopes.glsl"

// A pixel, and the cotangents of the picture before exposure and curves.
struct Pixel {
    vec4 scene, bloom;
    float share;
    // Of both sides: by colour and alpha, by exposure and by reference white.
    mat2x3 by_mixed;
    vec2 by_alpha, by_exposure, by_white;
};

// Within the range of the picture's format.
mat2x3 stored(vec3 value)
{
    return inside(value, params.limit == 1.0 ? 0.0 : -params.limit, params.limit);
}

mat2x3 back_through_encoding(vec3 toned, vec3 cotangent)
{
    mat2x3 kept = times(stored(apply_encoding(toned, ENCODING, params.reference_white)), cotangent);
    return matrixCompMult(kept, encoding_slope(toned, ENCODING, params.reference_white));
}

// The light that the alpha shows.
float alpha_light(vec4 bloom)
{
    float light = ALPHA == ALPHA_MAX ? max(bloom.r, max(bloom.g, bloom.b)) : bloom.a;
    return clamp(light_of(vec3(light)).r, 0.0, 1.0);
}

// The picture's alpha before it is stored.
float mixed_alpha(vec4 scene, vec4 bloom)
{
    if (ALPHA == ALPHA_KEEP || COMPOSITE == COMPOSITE_OFF)
        return scene.a;
    float light = alpha_light(bloom);
    return ALPHA == ALPHA_MAX ? max(scene.a, light) : scene.a + (1.0 - scene.a) * light;
}

Pixel pixel_of(vec4 given, vec4 bloom, float share, vec4 cotangent)
{
    Pixel p;
    p.scene = finite_or_zero(given);
    p.bloom = bloom;
    p.share = share;
    cotangent = where_finite(cotangent, given);
    p.by_alpha = cotangent.a * first_row(stored(vec3(mixed_alpha(p.scene, bloom))));
    vec3 mixed = composite(p.scene.rgb, p.bloom.rgb, p.share);
    // As exactly_toned(): without a difference near 0.
    if (COMPOSITE == COMPOSITE_MIX)
        mixed = (1.0 - params.intensity * p.share) * p.scene.rgb + light_of(p.bloom.rgb);
    vec3 exposed = mixed * exp2(params.exposure), toned = exactly_toned(exposed, TONEMAP);
    mat2x3 by_toned = back_through_encoding(toned, cotangent.rgb);
    mat2x3 by_exposed = back_through_tonemap(exposed, by_toned, TONEMAP);
    p.by_mixed = by_exposed * exp2(params.exposure);
    p.by_exposure = log(2.0) * dots(by_exposed, exposed);
    // The encoding takes the product of both.
    p.by_white = ENCODING == ENCODING_PQ ? dots(by_toned, toned) / params.reference_white : vec2(0.0);
    return p;
}

// What an image loses by a screen of the other one, until their product is 1.
vec3 screened(vec3 other, vec3 product)
{
    return 1.0 - other * (0.5 * (vec3(lessThan(product, vec3(1.0)))
                                 + vec3(lessThanEqual(product, vec3(1.0)))));
}

// By the light, i b.
mat2x3 by_light(Pixel p)
{
    vec3 light = light_of(p.bloom.rgb);
    if (COMPOSITE == COMPOSITE_UNCLAMPED_SCREEN)
        return times(p.by_mixed, screened(p.scene.rgb, p.scene.rgb * light));
    if (COMPOSITE != COMPOSITE_SCREEN)
        return p.by_mixed;
    return matrixCompMult(times(p.by_mixed, 1.0 - clamp(p.scene.rgb, 0.0, 1.0)),
                          inside(light, 0.0, 1.0));
}

// Of the light that the alpha shows, as the alpha's cotangent weighs it.
mat2x4 by_alpha_light(Pixel p)
{
    if (ALPHA == ALPHA_KEEP || COMPOSITE == COMPOSITE_OFF)
        return mat2x4(0.0);
    bool blurred = ALPHA == ALPHA_BLUR;
    float brightest = max(p.bloom.r, max(p.bloom.g, p.bloom.b));
    float light = light_of(vec3(blurred ? p.bloom.a : brightest)).r, held = clamp(light, 0.0, 1.0);
    float share = blurred             ? 1.0 - p.scene.a
                : held == p.scene.a ? 0.5
                                    : float(held > p.scene.a);
    vec2 by_held = p.by_alpha * share * first_row(inside(vec3(light), 0.0, 1.0));
    vec4 shares = vec4(0.0, 0.0, 0.0, 1.0);
    if (!blurred)
        shares = vec4(equal_shares(p.bloom.rgb, brightest), 0.0);
    return outerProduct(shares, by_held);
}

// Of the picture's alpha by that of the scene.
float alpha_slope(Pixel p)
{
    if (ALPHA == ALPHA_KEEP || COMPOSITE == COMPOSITE_OFF)
        return 1.0;
    float light = alpha_light(p.bloom);
    return ALPHA == ALPHA_BLUR ? 1.0 - light : p.scene.a == light ? 0.5 : float(p.scene.a > light);
}

mat2x4 by_scene(Pixel p)
{
    mat2x3 colour = p.by_mixed;
    if (COMPOSITE == COMPOSITE_MIX)
        colour *= 1.0 - params.intensity * p.share;
    if (COMPOSITE == COMPOSITE_SCREEN)
        colour = matrixCompMult(times(colour, 1.0 - clamp(light_of(p.bloom.rgb), 0.0, 1.0)),
                                inside(p.scene.rgb, 0.0, 1.0));
    if (COMPOSITE == COMPOSITE_UNCLAMPED_SCREEN)
        colour = times(colour, screened(light_of(p.bloom.rgb), p.scene.rgb * light_of(p.bloom.rgb)));
    if (COMPOSITE == COMPOSITE_ADD_TO_POSITIVE)
        colour = matrixCompMult(colour, above(p.scene.rgb, 0.0));
    return with_alpha(colour, p.by_alpha * alpha_slope(p));
}

mat2x4 by_bloom(Pixel p)
{
    float gain = BLOOM == BLOOM_LIT ? 1.0 : params.intensity;
    return gain * (with_alpha(by_light(p), vec2(0.0)) + by_alpha_light(p));
}

// By intensity, exposure and reference white.
mat2x4 by_values(Pixel p)
{
    vec3 unit = COMPOSITE == COMPOSITE_MIX ? p.bloom.rgb - p.share * p.scene.rgb : p.bloom.rgb;
    vec2 by_intensity = vec2(0.0);
    if (COMPOSITE != COMPOSITE_OFF)
        by_intensity = dots(by_light(p), unit) + p.bloom * by_alpha_light(p);
    return transpose(mat4x2(by_intensity, p.by_exposure, p.by_white, vec2(0.0)));
}

mat2x4 back_on_sides(vec4 given, vec4 bloom, float share, vec4 cotangent, int by)
{
    Pixel p = pixel_of(given, bloom, share, cotangent);
    if (by == BY_MIXED)
        return with_alpha(p.by_mixed, p.by_alpha);
    if (by == BY_VALUES)
        return by_values(p);
    if (by == BY_MASK)
        return outerProduct(vec4(1.0, 0.0, 0.0, 0.0), -params.intensity * dots(p.by_mixed, p.scene.rgb));
    return by == BY_BLOOM ? by_bloom(p) : by_scene(p);
}

// GROUPS is of a bloom that a clamp keeps at 0 or above. Where it is 0, it only grows: the mean of both
// sides is that of the clamp. BY_MIXED is of the picture before exposure and curves, which adds a share of
// the bloom to a share of the scene.
vec4 back_composite(vec4 given, vec4 bloom, float share, vec4 cotangent, int by)
{
    mat2x4 sides = back_on_sides(given, bloom, share, cotangent, by);
    bool clamped = GROUPS == GROUPS_PYGFX && by == BY_BLOOM;
    return mix(mean_of_sides(sides), sides[0], clamped ? equal(bloom, vec4(0.0)) : bvec4(false));
}
