// What both directions of Godot's blur share, and all variants of them.

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

const float GODOT_WEIGHTS[5] = float[](GODOT_KERNEL);

// The position from which a sample is read: samples are clamped in pairs.
int paired(int place, int length)
{
    int pair = clamp(place & ~1, 0, max(length - 2, 0));
    return min(pair + (place & 1), length - 1);
}

// The blurred frame with strength and exposure, which does not apply to alpha.
vec4 exposed(vec4 sum)
{
    vec4 value = sum / (1.0 - luminance(sum)) * params.strength;
    return vec4(value.rgb * exp2(params.exposure), value.a);
}

// The place of a colour in the transition of the threshold, 0 to 1.
float transition(vec4 value)
{
    float brightest = max(value.r, max(value.g, value.b));
    // A scale of 0 means a step.
    return clamp((brightest - params.threshold) / max(params.threshold_scale, 1e-6), 0.0, 1.0);
}

// The part of a colour that glows.
float feedback(vec4 value)
{
    float t = transition(value);
    return max(t * t * (3.0 - 2.0 * t), params.glow_bloom);
}

// What glows of the blurred frame. The cap does not apply to alpha.
vec4 glowing(vec4 sum)
{
    vec4 value = exposed(sum);
    if (THRESHOLDED != 0)
        value *= feedback(value);
    return vec4(min(value.rgb, vec3(params.luminance_cap)), value.a);
}
