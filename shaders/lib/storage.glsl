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

vec3 storable(vec3 value)
{
    vec3 kept = clamp(value, -params.limit, params.limit);
    if (params.limit == UNORM_LIMIT)
        return from_level(nearest_level(kept), STORED_UNORM8);
    return params.limit == HALF_LIMIT ? nearest_half(kept) : kept;
}

// The value that an image of that format returns after a store. Fused passes use it, so that their
// result equals that of the passes that they replace.
vec3 as_stored(vec3 value, int format)
{
    if (format == STORED_UNORM8 || format == STORED_UNORM8_SCALED)
        return from_level(nearest_level(value), format);
    if (format == STORED_HALF)
        return nearest_half(clamp(value, -HALF_LIMIT, HALF_LIMIT));
    return clamp(value, -SINGLE_LIMIT, SINGLE_LIMIT);
}
