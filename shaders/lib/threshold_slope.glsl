// Cotangents through the soft threshold (threshold.glsl).

// The slope of a maximum with b by a: 1 where a is larger, a half where both are equal.
vec4 larger(vec4 a, vec4 b)
{
    return vec4(greaterThan(a, b)) + 0.5 * vec4(equal(a, b));
}

// The factor of a colour and its derivative by the brightness.
vec2 soft_slope(float brightness, float threshold, float width, float divisor, float least)
{
    float above = brightness - threshold, moved = above + width, held = max(brightness, least);
    float soft = clamp(moved, 0.0, 2.0 * width), square = soft * soft / divisor;
    float by_square = moved < 0.0 || moved > 2.0 * width ? 0.0 : 2.0 * soft / divisor;
    float by_top = square > above ? by_square : square < above ? 1.0 : 0.5 * (by_square + 1.0);
    float factor = max(square, above) / held;
    return vec2(factor, (by_top - larger(vec4(brightness), vec4(least)).x * factor) / held);
}

vec3 shares_of_brightest(vec3 colour)
{
    vec3 share = vec3(equal(colour, vec3(max(colour.r, max(colour.g, colour.b)))));
    return share / (share.r + share.g + share.b);
}

vec4 back_through_soft(vec4 colour, vec4 cotangent, float threshold, float width, float divisor,
                       float least)
{
    float brightness = max(colour.r, max(colour.g, colour.b));
    vec2 slope = soft_slope(brightness, threshold, width, divisor, least);
    return slope.x * cotangent
         + vec4(shares_of_brightest(colour.rgb), 0.0) * (slope.y * dot(cotangent, colour));
}

// Through apply_threshold().
vec4 back_through_threshold(vec4 colour, vec4 cotangent, int mode, float threshold, float knee)
{
    if (mode == THRESHOLD_NONE)
        return cotangent;
    if (mode == THRESHOLD_HARD)
        return dot(colour.rgb, vec3(0.2126, 0.7152, 0.0722)) > threshold ? cotangent : vec4(0.0);
    float width = threshold * knee;
    return back_through_soft(colour, cotangent, threshold, width, 4.0 * width + 1e-5, 1e-5);
}
