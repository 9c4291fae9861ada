// The part of a colour that goes into the bloom, by its brightness.

// Hard: the colour if its Rec. 709 luminance is above the threshold, else black.
vec4 threshold_hard(vec4 colour, float threshold)
{
    return dot(colour.rgb, vec3(0.2126, 0.7152, 0.0722)) > threshold ? colour : vec4(0.0);
}

// Soft: a quadratic of half-width `width` around the threshold. Sources differ in the divisor, which
// is about 4 * width, and in the lower bound of the brightness that they divide by.
vec4 soft_threshold(vec4 colour, float threshold, float width, float divisor, float least)
{
    float brightness = max(colour.r, max(colour.g, colour.b));
    float soft = clamp(brightness - threshold + width, 0.0, 2.0 * width);
    soft = soft * soft / divisor;
    return colour * (max(soft, brightness - threshold) / max(brightness, least));
}

// The soft threshold of the setting `knee`.
vec4 threshold_knee(vec4 colour, float threshold, float knee)
{
    float width = threshold * knee;
    return soft_threshold(colour, threshold, width, 4.0 * width + 1e-5, 1e-5);
}

vec4 apply_threshold(vec4 colour, int mode, float threshold, float knee)
{
    if (mode == THRESHOLD_HARD)
        return threshold_hard(colour, threshold);
    if (mode == THRESHOLD_KNEE)
        return threshold_knee(colour, threshold, knee);
    return colour;
}

vec3 apply_threshold(vec3 colour, int mode, float threshold, float knee)
{
    return apply_threshold(vec4(colour, 1.0), mode, threshold, knee).rgb;
}
