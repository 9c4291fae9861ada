// Cotangents through the composite: of its scene and its bloom. The including shader has composite.glsl
// with its parameters.

// A pixel, and on one side (tonemap.glsl) the cotangents of the picture before exposure and curves: by
// colour and alpha, by exposure and by reference white. Of a soft light, which comes after the curve, the
// colours are not there yet: `by_mixed` is of what the encoding reads. Godot's scene is exposed already.
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

vec3 softened(Pixel p)
{
    return soft_light(apply_tonemap(p.scene.rgb, TONEMAP), apply_tonemap(light_of(p.bloom.rgb), TONEMAP));
}

Pixel pixel_of(vec4 given, vec4 bloom, float share, vec4 cotangent)
{
    Pixel p;
    float exposure = exp2(params.exposure);
    p.scene = finite_or_zero(given);
    if (EXPOSED_SCENE != 0)
        p.scene.rgb *= exposure;
    p.bloom = bloom;
    p.share = share;
    cotangent = where_finite(cotangent, given);
    p.by_alpha = cotangent.a * is_stored(vec3(mixed_alpha(p.scene.a, bloom))).x;
    vec3 mixed = composite(p.scene.rgb, p.bloom.rgb, p.share);
    // Encodings would magnify the rounding of a difference near 0.
    if (COMPOSITE == COMPOSITE_MIX)
        mixed = (1.0 - params.intensity * p.share) * p.scene.rgb + light_of(p.bloom.rgb);
    vec3 exposed = EXPOSED_SCENE != 0 ? mixed : mixed * exposure;
    vec3 toned = COMPOSITE == COMPOSITE_SOFT_LIGHT ? softened(p) : apply_tonemap(exposed, TONEMAP);
    vec3 by = cotangent.rgb, encoded = apply_encoding(toned, ENCODING, params.reference_white, by);
    by *= is_stored(encoded);
    // The encoding takes the product of both.
    p.by_white = ENCODING == ENCODING_PQ ? dot(by, toned) / params.reference_white : 0.0;
    if (COMPOSITE != COMPOSITE_SOFT_LIGHT)
        apply_tonemap(exposed, TONEMAP, by);
    p.by_mixed = EXPOSED_SCENE != 0 ? by : by * exposure;
    p.by_exposure = log(2.0) * dot(by, exposed);
    return p;
}

// Of a soft light, through the tone map of both.
Parts back_softened(Pixel p, vec3 light)
{
    vec3 s = p.scene.rgb;
    Parts parts = back_soft_light(apply_tonemap(s, TONEMAP), apply_tonemap(light, TONEMAP), p.by_mixed);
    apply_tonemap(s, TONEMAP, parts.scene);
    apply_tonemap(light, TONEMAP, parts.light);
    return parts;
}

Parts parts_of(Pixel p)
{
    vec3 light = light_of(p.bloom.rgb);
    return COMPOSITE == COMPOSITE_SOFT_LIGHT ? back_softened(p, light)
                                             : back_composite_formula(p.scene.rgb, light, p.share, p.by_mixed);
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
    vec3 colour = parts_of(p).scene;
    if (EXPOSED_SCENE != 0)
        colour *= exp2(params.exposure);
    return vec4(colour, p.by_alpha * alpha_slope(p));
}

vec4 by_bloom(Pixel p)
{
    float gain = LIT != 0 ? 1.0 : params.intensity;
    return gain * (vec4(parts_of(p).light, 0.0) + by_alpha_light(p));
}

// By intensity, exposure and reference white.
vec4 by_values(Pixel p)
{
    vec3 unit = COMPOSITE == COMPOSITE_MIX ? p.bloom.rgb - p.share * p.scene.rgb : p.bloom.rgb;
    float by_intensity = dot(parts_of(p).light, unit) + inner_product(by_alpha_light(p), p.bloom);
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

// CLAMPED is of a bloom that a clamp keeps at 0 or above. Where it is 0, it only grows: the mean of both
// sides is that of the clamp. The same holds for the alpha of a bloom that is THRESHOLDED, where nothing is above
// the threshold. BY_MIXED is of the picture before exposure and curves, which adds a share of the bloom to a share
// of the scene.
vec4 back_composite(vec4 given, vec4 bloom, float share, vec4 cotangent, int by)
{
    growing = true;
    vec4 up = back_on_side(given, bloom, share, cotangent, by);
    growing = false;
    vec4 mean = 0.5 * (up + back_on_side(given, bloom, share, cotangent, by));
    bool clamped = CLAMPED != 0 && by == BY_BLOOM;
    if (THRESHOLDED != 0 && by == BY_BLOOM && bloom == vec4(0.0))
        mean.a = up.a;
    return mix(mean, up, clamped ? equal(bloom, vec4(0.0)) : bvec4(false));
}
