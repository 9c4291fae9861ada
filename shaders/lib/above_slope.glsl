// Cotangents through above_threshold() (above.glsl). Include threshold_slope.glsl before this file.
vec4 back_above_threshold(vec4 value, vec4 cotangent)
{
    if (params.threshold <= 0.0)
        return cotangent;
    vec3 above = max(value.rgb - params.threshold, vec3(0.0));
    float most = max(above.r, max(above.g, above.b));
    float brightest = max(value.r, max(value.g, value.b)), held = max(brightest, 1e-30);
    float by_share = cotangent.a * value.a / held;
    vec3 by_above = cotangent.rgb + by_share * shares_of_brightest(value.rgb);
    float by_brightest = brightest > 1e-30 ? -by_share * most / held : 0.0;
    return vec4(by_above * larger(value, vec4(params.threshold)).rgb
                    + by_brightest * shares_of_brightest(value.rgb),
                cotangent.a * most / held);
}
