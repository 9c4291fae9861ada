// The saturation at the end of Blender's glare, for shaders with BLENDER_END_BLOCK.

// The saturation (max - min) / max is multiplied, and is then 0 to 1.
vec3 saturated(vec3 value)
{
    float most = max(value.r, max(value.g, value.b)), least = min(value.r, min(value.g, value.b));
    float spread = most - least;
    if (most <= 0.0 || spread == 0.0)
        return vec3(most);
    float wanted = min(params.saturation * (spread / most), 1.0);
    return most * (1.0 - wanted) + (value - least) * (wanted * most / spread);
}

// Channels that differ from the largest or the smallest one, or from 0, by rounding alone are equal to it.
vec3 settled(vec3 value)
{
    vec3 near = mix(value, vec3(0.0), lessThanEqual(abs(value), vec3(params.rounding)));
    float most = largest(near), least = -largest(-near);
    near = mix(near, vec3(most), lessThanEqual(abs(near - most), vec3(params.rounding * (1.0 + 10.0 * abs(most)))));
    return mix(near, vec3(least), lessThanEqual(abs(near - least), vec3(params.rounding * (1.0 + 10.0 * abs(least)))));
}

// Each channel's distance from the largest one is scaled: by the saturation, or by less where that would make a channel
// negative. Around a grey, distances grow from 0; around black, opposite changes of two channels grow by at most 1/2.
vec3 back_saturated(vec3 value, vec3 cotangent)
{
    float most = largest(value), least = -largest(-value), spread = most - least, scale = params.saturation;
    vec3 at_most = shares_of_brightest(value), by_scale = vec3(0.0);
    if (spread > 0.0 && most < scale * spread) {
        scale = max(most, 0.0) / spread;
        // The slope of the scale, by what has it.
        vec3 at_spread = at_most - shares_of_brightest(-value);
        by_scale = (at_most * larger(most, 0.0) - scale * at_spread) * dot(cotangent, (value - most) / spread);
    } else if (spread == 0.0 && most <= 0.0) {
        scale = most < 0.0 ? 0.0 : min(scale, 0.5);
    }
    return scale * cotangent + at_most * ((1.0 - scale) * dot(cotangent, vec3(1.0))) + by_scale;
}
