// Cotangents through the composite: of its scene and its bloom. The including shader has composite.glsl
// with its parameters, and where_finite.glsl.
#include "lib/tonemap_slopes.glsl"

// A pixel, and the cotangents of the picture before exposure and curves.
struct Pixel {
    vec4 scene, bloom, cotangent;
    float share;
    vec3 mixed, by_mixed;
    // By exposure and reference white.
    vec2 by_curves;
};

// Within the range of the picture's format.
vec3 stored(vec3 value)
{
    return inside(value, params.limit == 1.0 ? 0.0 : -params.limit, params.limit);
}

vec3 back_through_encoding(vec3 toned, vec3 cotangent)
{
    vec3 kept = cotangent * stored(apply_encoding(toned, ENCODING, params.reference_white));
    return kept * encoding_slope(toned, ENCODING, params.reference_white);
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
    p.cotangent = where_finite(cotangent, given);
    p.cotangent.a *= stored(vec3(mixed_alpha(p.scene, bloom))).r;
    p.mixed = composite(p.scene.rgb, p.bloom.rgb, p.share);
    // As exactly_toned(): without a difference near 0.
    if (COMPOSITE == COMPOSITE_MIX)
        p.mixed = (1.0 - params.intensity * p.share) * p.scene.rgb + light_of(p.bloom.rgb);
    vec3 exposed = p.mixed * exp2(params.exposure), toned = exactly_toned(exposed, TONEMAP);
    vec3 by_toned = back_through_encoding(toned, p.cotangent.rgb);
    vec3 by_exposed = back_through_tonemap(exposed, by_toned, TONEMAP);
    p.by_mixed = by_exposed * exp2(params.exposure);
    p.by_curves.x = log(2.0) * dot(by_exposed, exposed);
    // The encoding takes the product of both.
    p.by_curves.y =
        ENCODING == ENCODING_PQ ? dot(by_toned, toned) / params.reference_white : 0.0;
    return p;
}

// What an image loses by a screen of the other one, until their product is 1.
vec3 screened(vec3 other, vec3 product)
{
    return 1.0 - other * (0.5 * (vec3(lessThan(product, vec3(1.0)))
                                 + vec3(lessThanEqual(product, vec3(1.0)))));
}

// By the light, i b.
vec3 by_light(Pixel p)
{
    vec3 light = light_of(p.bloom.rgb);
    if (COMPOSITE == COMPOSITE_UNCLAMPED_SCREEN)
        return p.by_mixed * screened(p.scene.rgb, p.scene.rgb * light);
    if (COMPOSITE != COMPOSITE_SCREEN)
        return p.by_mixed;
    return p.by_mixed * (1.0 - clamp(p.scene.rgb, 0.0, 1.0)) * inside(light_of(p.bloom.rgb), 0.0, 1.0);
}

// Of the light that the alpha shows, as the alpha's cotangent weighs it.
vec4 by_alpha_light(Pixel p)
{
    if (ALPHA == ALPHA_KEEP || COMPOSITE == COMPOSITE_OFF)
        return vec4(0.0);
    if (ALPHA == ALPHA_BLUR) {
        float light = light_of(p.bloom.aaa).r;
        return vec4(vec3(0.0), p.cotangent.a * (1.0 - p.scene.a) * inside(vec3(light), 0.0, 1.0).r);
    }
    float brightest = max(p.bloom.r, max(p.bloom.g, p.bloom.b)), light = light_of(vec3(brightest)).r;
    float held = clamp(light, 0.0, 1.0);
    float share = held > p.scene.a ? 1.0 : held == p.scene.a ? 0.5 : 0.0;
    share *= inside(vec3(light), 0.0, 1.0).r;
    return vec4(p.cotangent.a * share * equal_shares(p.bloom.rgb, brightest), 0.0);
}

// Of the picture's alpha by that of the scene.
float alpha_slope(Pixel p)
{
    if (ALPHA == ALPHA_KEEP || COMPOSITE == COMPOSITE_OFF)
        return 1.0;
    float light = alpha_light(p.bloom);
    return ALPHA == ALPHA_BLUR ? 1.0 - light : p.scene.a == light ? 0.5 : float(p.scene.a > light);
}

vec4 by_scene(Pixel p)
{
    vec3 colour = p.by_mixed;
    if (COMPOSITE == COMPOSITE_MIX)
        colour *= 1.0 - params.intensity * p.share;
    if (COMPOSITE == COMPOSITE_SCREEN)
        colour *= (1.0 - clamp(light_of(p.bloom.rgb), 0.0, 1.0)) * inside(p.scene.rgb, 0.0, 1.0);
    if (COMPOSITE == COMPOSITE_UNCLAMPED_SCREEN)
        colour *= screened(light_of(p.bloom.rgb), p.scene.rgb * light_of(p.bloom.rgb));
    if (COMPOSITE == COMPOSITE_ADD_TO_POSITIVE)
        colour *= above(p.scene.rgb, 0.0);
    return vec4(colour, p.cotangent.a * alpha_slope(p));
}

vec4 by_bloom(Pixel p)
{
    float gain = BLOOM == BLOOM_LIT ? 1.0 : params.intensity;
    return gain * (vec4(by_light(p), 0.0) + by_alpha_light(p));
}

// By intensity, exposure and reference white.
vec4 by_values(Pixel p)
{
    vec3 unit = COMPOSITE == COMPOSITE_MIX ? p.bloom.rgb - p.share * p.scene.rgb : p.bloom.rgb;
    float by_intensity = COMPOSITE == COMPOSITE_OFF
                           ? 0.0
                           : dot(by_light(p), unit) + dot(by_alpha_light(p), p.bloom);
    return vec4(by_intensity, p.by_curves, 0.0);
}

vec4 back_on_side(vec4 given, vec4 bloom, float share, vec4 cotangent, int by, bool side)
{
    growing = side;
    Pixel p = pixel_of(given, bloom, share, cotangent);
    if (by == BY_MIXED)
        return vec4(p.by_mixed, p.cotangent.a);
    if (by >= BY_VALUES)
        return by_values(p);
    if (by == BY_MASK)
        return vec4(-params.intensity * dot(p.by_mixed, p.scene.rgb), 0.0, 0.0, 0.0);
    return by == BY_BLOOM ? by_bloom(p) : by_scene(p);
}

// GROUPS is of a bloom that a clamp keeps at 0 or above. Where it is 0, it only grows: the mean of both
// sides is that of the clamp. BY_MIXED is of the picture before exposure and curves, which adds a share of
// the bloom to a share of the scene.
vec4 back_composite(vec4 given, vec4 bloom, float share, vec4 cotangent, int by)
{
    vec4 grown = back_on_side(given, bloom, share, cotangent, by, true);
    vec4 mean = mean_of_sides(grown, back_on_side(given, bloom, share, cotangent, by, false));
    bool clamped = GROUPS == GROUPS_PYGFX && by == BY_BLOOM;
    return mix(mean, grown, clamped ? equal(bloom, vec4(0.0)) : bvec4(false));
}
