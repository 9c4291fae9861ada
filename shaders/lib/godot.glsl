// What both directions of Godot's blur share, and all variants of them.

// In units of the cap, which is at least 6. Negative luminances count as 0.
float luminance(vec4 value)
{
    return max(dot(value.rgb, vec3(0.299, 0.587, 0.114)), 0.0) / max(params.luminance_cap, 6.0);
}

// A sample; brighter ones of the frame weigh less, against fireflies.
vec4 dimmed(vec4 value)
{
    return FIRST != 0 ? value / (1.0 + luminance(value)) : value;
}

const float GODOT_WEIGHTS[5] = float[](GODOT_KERNEL);
