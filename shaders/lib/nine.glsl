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
    return FIRST != 0 ? value / (1.0 + luminance(value)) : value;
}

const int NINE_RADIUS = 4;

// The half-kernels; HDRP's is a binomial of order 8.
float nine_weight(int tap)
{
    const float godots[5] = float[](0.2024, 0.1790, 0.1240, 0.0672, 0.0285);
    const float hdrps[5] = float[](0.2734375, 0.21875, 0.109375, 0.03125, 0.00390625);
    return GROUPS == GROUPS_GODOT ? godots[abs(tap)] : hdrps[abs(tap)];
}

// The position from which a sample is read: samples are clamped in pairs.
int paired(int place, int length)
{
    int pair = clamp(place & ~1, 0, max(length - 2, 0));
    return min(pair + (place & 1), length - 1);
}

// What glows of the blurred frame, after strength and exposure. Neither exposure nor the cap applies to alpha.
vec4 glowing(vec4 sum)
{
    vec4 value = sum / (1.0 - luminance(sum)) * params.strength;
    value.rgb *= exp2(params.exposure);
    if (THRESHOLDED != 0) {
        float brightest = max(value.r, max(value.g, value.b));
        // A scale of 0 means a step.
        float t = clamp((brightest - params.threshold) / max(params.threshold_scale, 1e-6), 0.0, 1.0);
        value *= max(t * t * (3.0 - 2.0 * t), params.glow_bloom);
    }
    return vec4(min(value.rgb, vec3(params.luminance_cap)), value.a);
}
