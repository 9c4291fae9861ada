// What a stage of glare reads of a texel. The including shader's block has a threshold.

// The channels above the threshold. Alpha is multiplied by the factor of the brightest channel.
vec4 above_threshold(vec4 value)
{
    vec3 above = max(value.rgb - params.threshold, vec3(0.0));
    float brightest = max(value.r, max(value.g, value.b));
    float share = max(above.r, max(above.g, above.b)) / max(brightest, 1e-30);
    return params.threshold > 0.0 ? vec4(above, value.a * share) : value;
}
