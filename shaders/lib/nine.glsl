// What the directions and the variants of blurs of nine taps share: of Godot's, and of HDRP's.

const vec3 GODOT_LUMINANCE = vec3(0.299, 0.587, 0.114);

// In units of the cap, which is at least 6. Negative luminances count as 0.
float luminance(vec4 value)
{
    return max(dot(value.rgb, GODOT_LUMINANCE), 0.0) / max(params.luminance_cap, 6.0);
}

// A sample; brighter ones of the frame weigh less, against fireflies.
vec4 dimmed(vec4 value)
{
    return FIRST_LEVEL != 0 ? value / (1.0 + luminance(value)) : value;
}

const int NINE_RADIUS = 4;

float nine_weight(int tap)
{
    const float godots[5] = float[](GODOT_NINE), hdrps[5] = float[](HDRP_NINE);
    return GROUPS == GROUPS_GODOT ? godots[abs(tap)] : hdrps[abs(tap)];
}

// The position from which a sample is read: samples are clamped in pairs.
int paired(int place, int length)
{
    int pair = clamp(place & ~1, 0, max(length - 2, 0));
    return min(pair + (place & 1), length - 1);
}

// Through value / (1 + L), or with a sign of -1 through value / (1 - L), for the luminance L.
vec4 back_dimmed(vec4 value, vec4 cotangent, float sign)
{
    float divisor = 1.0 + sign * luminance(value), grey = dot(value.rgb, GODOT_LUMINANCE);
    float slope = sign * larger(grey, 0.0) / max(params.luminance_cap, 6.0);
    float by_divisor = -dot(cotangent, value) / divisor / divisor;
    return cotangent / divisor + vec4(slope * by_divisor * GODOT_LUMINANCE, 0.0);
}

// The blurred frame after strength and exposure. Neither exposure nor the cap applies to alpha.
vec4 exposed(vec4 sum)
{
    vec4 value = sum / (1.0 - luminance(sum)) * params.strength;
    value.rgb *= exp2(params.exposure);
    return value;
}

// The factor of what is above the threshold, in alpha, and its derivatives by the channels.
vec4 glow_factor(vec3 colour)
{
    float brightest = max(colour.r, max(colour.g, colour.b)), scale = max(params.threshold_scale, 1e-6);
    // A scale of 0 means a step.
    float t = clamp((brightest - params.threshold) / scale, 0.0, 1.0), share = t * t * (3.0 - 2.0 * t);
    float slope = larger(share, params.glow_bloom) * 6.0 * t * (1.0 - t) / scale;
    return vec4(slope * shares_of_brightest(colour), max(share, params.glow_bloom));
}

// What glows of it.
vec4 glowing(vec4 sum)
{
    vec4 value = exposed(sum);
    if (THRESHOLDED != 0)
        value *= glow_factor(value.rgb).a;
    return vec4(min(value.rgb, vec3(params.luminance_cap)), value.a);
}

vec4 back_glowing(vec4 sum, vec4 cotangent)
{
    vec4 value = exposed(sum), factor = THRESHOLDED != 0 ? glow_factor(value.rgb) : vec4(0.0, 0.0, 0.0, 1.0);
    cotangent.rgb *= larger(vec4(params.luminance_cap), factor.a * value).rgb;
    cotangent = back_through_factor(value, factor, cotangent);
    cotangent.rgb *= exp2(params.exposure);
    return back_dimmed(sum, params.strength * cotangent, -1.0);
}
