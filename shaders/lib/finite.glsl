// Tests the bits, since compilers may assume that isnan() and isinf() are false.

bvec3 is_finite(vec3 value)
{
#if defined(LINEAR_TEXELS) && CHANNEL_BYTES == 1
    return bvec3(true);
#endif
    uvec3 bits = FINITE != 0 ? uvec3(0) : floatBitsToUint(value);
    return notEqual(bits & 0x7f800000u, uvec3(0x7f800000u));
}

// Replaces NaN and infinity by 0 in each channel.
vec3 finite_or_zero(vec3 value)
{
    return mix(vec3(0.0), value, is_finite(value));
}

vec4 finite_or_zero(vec4 value)
{
    return vec4(finite_or_zero(value.rgb), finite_or_zero(value.aaa).r);
}

// The cotangents of a value, which has none at NaN and infinity.
vec4 where_finite(vec4 cotangent, vec4 value)
{
    return vec4(mix(vec3(0.0), cotangent.rgb, is_finite(value.rgb)),
                is_finite(value.aaa).r ? cotangent.a : 0.0);
}
