// Cotangents through the composite: of its scene and its bloom. The including shader has composite.glsl
// with its parameters.

// A pixel, and on one side (tonemap.glsl) the cotangents of the picture before exposure and curves: by
// colour and alpha, by exposure and by reference white.
struct Pixel {
    vec4 scene, bloom;
    float share;
    vec3 by_mixed;
    float by_alpha, by_exposure, by_white;
};

// Within the range of the picture's format.
vec3 is_stored(vec3 value)
{
    return inside(value, params.limit == 1.0 ? 0.0 : -params.limit, params.limit);
}

Pixel pixel_of(vec4 given, vec4 bloom, float share, vec4 cotangent)
{
    Pixel p;
    p.scene = finite_or_zero(given);
    p.bloom = bloom;
    p.share = share;
    cotangent = where_finite(cotangent, given);
    p.by_alpha = cotangent.a * is_stored(vec3(mixed_alpha(p.scene.a, bloom))).x;
    vec3 mixed = composite(p.scene.rgb, p.bloom.rgb, p.share);
    // Encodings would magnify the rounding of a difference near 0.
    if (COMPOSITE == COMPOSITE_MIX)
        mixed = (1.0 - params.intensity * p.share) * p.scene.rgb + light_of(p.bloom.rgb);
    vec3 exposed = mixed * exp2(params.exposure), toned = apply_tonemap(exposed, TONEMAP);
    vec3 by = cotangent.rgb, encoded = apply_encoding(toned, ENCODING, params.reference_white, by);
    by *= is_stored(encoded);
    // The encoding takes the product of both.
    p.by_white = ENCODING == ENCODING_PQ ? dot(by, toned) / params.reference_white : 0.0;
    apply_tonemap(exposed, TONEMAP, by);
    p.by_mixed = by * exp2(params.exposure);
    p.by_exposure = log(2.0) * dot(by, exposed);
    return p;
}

// The derivative of a screen by one of its images.
vec3 screen_slope(vec3 image, vec3 other)
{
    if (COMPOSITE == COMPOSITE_SCREEN)
        return (1.0 - clamp(other, 0.0, 1.0)) * inside(image, 0.0, 1.0);
    return COMPOSITE == COMPOSITE_UNCLAMPED_SCREEN ? 1.0 - other * below(image * other, 1.0) : vec3(1.0);
}

// By the light, i b.
vec3 by_light(Pixel p)
{
    return p.by_mixed * screen_slope(light_of(p.bloom.rgb), p.scene.rgb);
}

// Of the light that the alpha shows, as the alpha's cotangent weighs it.
vec4 by_alpha_light(Pixel p)
{
    float light = alpha_light(p.bloom), by = p.by_alpha * inside(vec3(light), 0.0, 1.0).x;
    if (ALPHA == ALPHA_KEEP || COMPOSITE == COMPOSITE_OFF)
        return vec4(0.0);
    if (ALPHA == ALPHA_BLUR)
        return vec4(0.0, 0.0, 0.0, by * (1.0 - p.scene.a));
    by *= above(vec3(clamp(light, 0.0, 1.0)), p.scene.a).x;
    return vec4(by * shares_of_brightest(p.bloom.rgb), 0.0);
}

// Of the picture's alpha by that of the scene.
float alpha_slope(Pixel p)
{
    float light = clamp(alpha_light(p.bloom), 0.0, 1.0);
    if (ALPHA == ALPHA_KEEP || COMPOSITE == COMPOSITE_OFF)
        return 1.0;
    return ALPHA == ALPHA_BLUR ? 1.0 - light : above(vec3(p.scene.a), light).x;
}

vec4 by_scene(Pixel p)
{
    vec3 colour = p.by_mixed * screen_slope(p.scene.rgb, light_of(p.bloom.rgb));
    if (COMPOSITE == COMPOSITE_MIX)
        colour *= 1.0 - params.intensity * p.share;
    if (COMPOSITE == COMPOSITE_ADD_TO_POSITIVE)
        colour *= above(p.scene.rgb, 0.0);
    return vec4(colour, p.by_alpha * alpha_slope(p));
}

vec4 by_bloom(Pixel p)
{
    float gain = LIT != 0 ? 1.0 : params.intensity;
    return gain * (vec4(by_light(p), 0.0) + by_alpha_light(p));
}

// By intensity, exposure and reference white.
vec4 by_values(Pixel p)
{
    vec3 unit = COMPOSITE == COMPOSITE_MIX ? p.bloom.rgb - p.share * p.scene.rgb : p.bloom.rgb;
    float by_intensity = dot(by_light(p), unit) + dot(by_alpha_light(p), p.bloom);
    return vec4(COMPOSITE == COMPOSITE_OFF ? 0.0 : by_intensity, p.by_exposure, p.by_white, 0.0);
}

vec4 back_on_side(vec4 given, vec4 bloom, float share, vec4 cotangent, int by)
{
    Pixel p = pixel_of(given, bloom, share, cotangent);
    if (by == BY_MIXED)
        return vec4(p.by_mixed, p.by_alpha);
    if (by == BY_VALUES)
        return by_values(p);
    if (by == BY_MASK)
        return vec4(-params.intensity * dot(p.by_mixed, p.scene.rgb), 0.0, 0.0, 0.0);
    return by == BY_BLOOM ? by_bloom(p) : by_scene(p);
}

// GROUPS is of a bloom that a clamp keeps at 0 or above. Where it is 0, it only grows: the mean of both
// sides is that of the clamp. The same holds for the alpha of a bloom that is THRESHOLDED, where nothing is above
// the threshold. BY_MIXED is of the picture before exposure and curves, which adds a share of the bloom to a share
// of the scene.
vec4 back_composite(vec4 given, vec4 bloom, float share, vec4 cotangent, int by)
{
    growing = true;
    vec4 up = back_on_side(given, bloom, share, cotangent, by);
    growing = false;
    vec4 mean = 0.5 * (up + back_on_side(given, bloom, share, cotangent, by));
    bool clamped = GROUPS == GROUPS_PYGFX && by == BY_BLOOM;
    if (THRESHOLDED != 0 && by == BY_BLOOM && bloom == vec4(0.0))
        mean.a = up.a;
    return mix(mean, up, clamped ? equal(bloom, vec4(0.0)) : bvec4(false));
}
