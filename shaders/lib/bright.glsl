// Unreal Engine's filter of bright colours before a convolution, for shaders with FFT_BLOCK.

vec3 prefiltered(vec3 colour)
{
    float luminance = dot(colour, vec3(0.2126, 0.7152, 0.0722));
    float wanted = min(params.prefilter_factor * (luminance - params.prefilter_min)
                           + params.prefilter_min,
                       params.prefilter_max);
    return luminance > params.prefilter_min ? colour * (wanted / luminance) : colour;
}

vec3 back_prefiltered(vec3 colour, vec3 cotangent)
{
    float luminance = dot(colour, LUMINANCE);
    if (luminance <= params.prefilter_min)
        return cotangent;
    float line = params.prefilter_factor * (luminance - params.prefilter_min) + params.prefilter_min;
    float ratio = min(line, params.prefilter_max) / luminance;
    float slope = params.prefilter_factor * larger(params.prefilter_max, line);
    return ratio * cotangent + LUMINANCE * (dot(cotangent, colour / luminance) * (slope - ratio));
}

// What a convolution spreads: finite, and so that sums are, too.
vec3 kept_of(vec3 colour)
{
    return limited(finite_or_zero(vec4(colour, 0.0)).rgb, FFT_LIMIT);
}

vec4 glow_of(vec4 texel)
{
    vec4 kept = vec4(kept_of(texel.rgb), kept_of(texel.aaa).r);
    return vec4(PREFILTERED != 0 ? prefiltered(kept.rgb) : kept.rgb, ALPHA == ALPHA_BLUR ? kept.a : 0.0);
}
