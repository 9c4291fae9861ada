// Values that a shader writes to a target. They are clamped to the range of its format, since later
// passes would spread an infinity over the picture. They are rounded to the nearest half float, since
// some adapters (llvmpipe among them) truncate, which darkens the picture with every pass. They are
// rounded to the nearest 8-bit level, since some GPUs round values near the middle of two levels down.

// The nearest half float, ties to even, including subnormal ones. The last bit of `magic` has the
// weight of the half float's last bit, so that the addition rounds at this bit.
vec3 nearest_half(vec3 value)
{
    uvec3 bits = floatBitsToUint(value);
    uvec3 exponent = max(bits & 0x7f800000u, 0x38800000u);
    vec3 magic = uintBitsToFloat(exponent + ((13u << 23) + 0x400000u));
    // Keep the sign of zero.
    return uintBitsToFloat(floatBitsToUint((value + magic) - magic) | (bits & 0x80000000u));
}

// The nearest of the 256 levels, 0 to 255, ties to even.
vec3 nearest_level(vec3 value)
{
    return roundEven(255.0 * clamp(value, 0.0, 1.0));
}

// The value of a level, as a texel of an 8-bit image returns it. GPUs return the float nearest to
// level / 255. This is computed without a division, which a compiler may replace by a product with an
// error of one bit. The first product is exact. llvmpipe multiplies by the float nearest to 1 / 255.
vec3 from_level(vec3 level, int format)
{
    const float SHARE = 1.0 / 255.0;
    if (format == STORED_UNORM8_SCALED)
        return level * SHARE;
    return level * (257.0 / 65536.0) + level * (SHARE / 65536.0);
}

// The nearest floats with 5 bits of exponent and 6 of mantissa (of blue 5), ties to even: what images
// of R11G11B10 hold. Negative values and NaN become 0. Larger values become the largest one.
vec3 nearest_ufloat(vec3 value)
{
    const uvec3 dropped = uvec3(17, 17, 18);
    // The smallest normal value, 2^-14. Below it the steps are constant.
    const float LEAST = 6.103515625e-5;
    const vec3 steps = vec3(1048576.0, 1048576.0, 524288.0);
    vec3 kept = mix(vec3(0.0), min(value, vec3(UFLOAT11_LIMIT, UFLOAT11_LIMIT, UFLOAT10_LIMIT)),
                    greaterThan(value, vec3(0.0)));
    uvec3 bits = floatBitsToUint(kept);
    bits += (uvec3(1) << (dropped - 1u)) - 1u + ((bits >> dropped) & 1u);
    vec3 normal = uintBitsToFloat((bits >> dropped) << dropped);
    return mix(normal, roundEven(kept * steps) / steps, lessThan(kept, vec3(LEAST)));
}

vec3 storable(vec3 value)
{
    if (params.limit == UFLOAT11_LIMIT)
        return nearest_ufloat(value);
    vec3 kept = clamp(value, -params.limit, params.limit);
    if (params.limit == UNORM_LIMIT)
        return from_level(nearest_level(kept), STORED_UNORM8);
    return params.limit == HALF_LIMIT ? nearest_half(kept) : kept;
}

// A value of a bloom buffer. Its alpha is 1, unless alpha is blurred like a colour.
vec4 stored(vec4 value)
{
    return vec4(storable(value.rgb), ALPHA == ALPHA_BLUR ? storable(value.aaa).r : 1.0);
}

// The value that an image of that format returns after a store. Fused passes use it, so that their
// result equals that of the passes that they replace.
vec3 as_stored(vec3 value, int format)
{
    if (format == STORED_UNORM8 || format == STORED_UNORM8_SCALED)
        return from_level(nearest_level(value), format);
    if (format == STORED_HALF)
        return nearest_half(clamp(value, -HALF_LIMIT, HALF_LIMIT));
    if (format == STORED_UFLOAT)
        return nearest_ufloat(value);
    return clamp(value, -SINGLE_LIMIT, SINGLE_LIMIT);
}

vec4 as_stored(vec4 value, int format)
{
    return vec4(as_stored(value.rgb, format), as_stored(value.aaa, format).r);
}
