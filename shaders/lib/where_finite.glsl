// The cotangents of a value, which has none at NaN and infinity (finite.glsl).
vec4 where_finite(vec4 cotangent, vec4 value)
{
    return vec4(mix(vec3(0.0), cotangent.rgb, is_finite(value.rgb)),
                is_finite(value.aaa).r ? cotangent.a : 0.0);
}
