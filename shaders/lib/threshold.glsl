// The part of a colour that goes into the bloom, by its brightness, and cotangents through it.

// Rec. 709.
const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722);

// The slope of a maximum with b by a: 1 where a is larger, a half where both are equal.
vec4 larger(vec4 a, vec4 b)
{
    return vec4(greaterThan(a, b)) + 0.5 * vec4(equal(a, b));
}

float larger(float a, float b)
{
    return larger(vec4(a), vec4(b)).x;
}

float largest(vec3 value)
{
    return max(value.r, max(value.g, value.b));
}

// The slope of the largest channel: equal ones have equal shares. (NaN, and a maximum that a device rounds to 0, equal
// none.)
vec3 shares_of_brightest(vec3 colour)
{
    vec3 share = vec3(equal(colour, vec3(largest(colour))));
    return share / max(share.r + share.g + share.b, 1.0);
}

// A soft threshold's factor of a colour, and its derivatives by brightness, threshold and width.
struct Soft {
    float factor, by_brightness, by_threshold, by_width;
};

// A quadratic of half-width `width` around the threshold. Sources differ in the divisor, which is
// about 4 * width, and in the lower bound of the brightness that they divide by.
Soft soft_threshold(float brightness, float threshold, float width, float divisor, float least)
{
    float above = brightness - threshold, moved = above + width, held = max(brightness, least);
    float soft = clamp(moved, 0.0, 2.0 * width), square = soft * soft / divisor;
    float factor = max(square, above) / held, by_soft = 2.0 * soft / divisor;
    // By what is above the threshold, and by the width.
    vec2 by_square = moved < 0.0         ? vec2(0.0)
                   : moved > 2.0 * width ? vec2(0.0, 2.0 * by_soft)
                                         : vec2(by_soft);
    by_square.y -= 4.0 * square / divisor;
    vec2 by_top = mix(by_square, vec2(1.0, 0.0), larger(above, square));
    return Soft(factor, (by_top.x - larger(brightness, least) * factor) / held, -by_top.x / held,
                by_top.y / held);
}

// The factor, in alpha, and its derivatives by the channels.
vec4 soft_factor(Soft soft, vec3 colour)
{
    return vec4(soft.by_brightness * shares_of_brightest(colour), soft.factor);
}

// The derivatives of the factor by threshold and knee, whose product is the width or a part of it.
vec2 by_threshold_and_knee(Soft soft, float threshold, float knee)
{
    return vec2(soft.by_threshold + knee * soft.by_width, threshold * soft.by_width);
}

// The factor of the setting `knee`.
Soft knee_of(vec3 colour, float threshold, float knee)
{
    float width = threshold * knee;
    return soft_threshold(largest(colour), threshold, width, 4.0 * width + 1e-5, 1e-5);
}

vec4 knee_factor(vec3 colour, float threshold, float knee)
{
    return soft_factor(knee_of(colour, threshold, knee), colour);
}

// Hard: the colour if its luminance is above the threshold, else black.
vec4 apply_threshold(vec4 colour, int mode, float threshold, float knee)
{
    if (mode == THRESHOLD_HARD)
        return dot(colour.rgb, LUMINANCE) > threshold ? colour : vec4(0.0);
    if (mode == THRESHOLD_KNEE)
        return colour * knee_factor(colour.rgb, threshold, knee).a;
    return colour;
}

vec3 apply_threshold(vec3 colour, int mode, float threshold, float knee)
{
    return apply_threshold(vec4(colour, 1.0), mode, threshold, knee).rgb;
}

// Through a product with a factor.
vec4 back_through_factor(vec4 colour, vec4 factor, vec4 cotangent)
{
    return factor.a * cotangent + vec4(factor.rgb * dot(cotangent, colour), 0.0);
}

vec4 back_through_threshold(vec4 colour, vec4 cotangent, int mode, float threshold, float knee)
{
    if (mode == THRESHOLD_HARD)
        return dot(colour.rgb, LUMINANCE) > threshold ? cotangent : vec4(0.0);
    if (mode == THRESHOLD_KNEE)
        return back_through_factor(colour, knee_factor(colour.rgb, threshold, knee), cotangent);
    return cotangent;
}

// The channels above a threshold. Alpha is multiplied by the factor of the brightest channel.
vec4 part_above(vec4 value, float threshold)
{
    vec3 above = max(value.rgb - threshold, vec3(0.0));
    return vec4(above, value.a * (largest(above) / max(largest(value.rgb), 1e-30)));
}

// Nothing is divided by 0 at black, also in what is multiplied by 0: 0 / 0 is NaN, though llvmpipe leaves out
// products with a constant 0.
vec4 back_part_above(vec4 value, vec4 cotangent, float threshold)
{
    float brightest = largest(value.rgb), held = max(max(brightest, threshold), 1e-30);
    float by_brightest =
        cotangent.a * value.a * larger(brightest, threshold) * (threshold / held / held);
    return vec4(cotangent.rgb * larger(value, vec4(threshold)).rgb
                    + by_brightest * shares_of_brightest(value.rgb),
                cotangent.a * max(brightest - threshold, 0.0) / held);
}
