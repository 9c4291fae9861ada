// What a stage of glare reads of a texel. The including shader's block has a threshold. Include
// threshold.glsl before this file.

// The channels above the threshold. Alpha is multiplied by the factor of the brightest channel.
vec4 part_above(vec4 value)
{
    vec3 above = max(value.rgb - params.threshold, vec3(0.0));
    return vec4(above, value.a * (largest(above) / max(largest(value.rgb), 1e-30)));
}

vec4 above_threshold(vec4 value)
{
    return params.threshold > 0.0 ? part_above(value) : value;
}

// Through part_above().
vec4 back_part_above(vec4 value, vec4 cotangent)
{
    float brightest = largest(value.rgb), held = max(brightest, 1e-30);
    float by_brightest =
        cotangent.a * value.a * larger(brightest, params.threshold) * params.threshold / (held * held);
    return vec4(cotangent.rgb * larger(value, vec4(params.threshold)).rgb
                    + by_brightest * shares_of_brightest(value.rgb),
                cotangent.a * max(brightest - params.threshold, 0.0) / held);
}
