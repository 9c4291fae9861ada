// What a shader writes to a target: kept inside the range of its format, for a value that overflowed
// to infinity would spread over the picture in the passes after it; and for half floats rounded to
// the nearest one, for some adapters (llvmpipe among them) cut the bits off, which makes a picture
// darker pass by pass. Likewise for 8 bits: conversions of some GPUs round values near the middle of
// two levels down.

// The nearest half float, ties to even, also below the smallest normal one: the sum with a float
// whose last bit is the half's, but for the exponent of the value, leaves no other bits.
vec3 nearest_half(vec3 value)
{
    uvec3 bits = floatBitsToUint(value);
    uvec3 exponent = max(bits & 0x7f800000u, 0x38800000u);
    vec3 magic = uintBitsToFloat(exponent + ((13u << 23) + 0x400000u));
    // A zero keeps its sign.
    return uintBitsToFloat(floatBitsToUint((value + magic) - magic) | (bits & 0x80000000u));
}

// The nearest of the 256 levels, ties to even: 0 to 255.
vec3 nearest_level(vec3 value)
{
    return roundEven(255.0 * clamp(value, 0.0, 1.0));
}

// The level as a value, as a texel of an image of 8 bits has it. GPUs divide by 255, and round to the
// nearest float: here without a division, of which a compiler may make a product that is one bit off.
// The first product is exact. llvmpipe multiplies by the float that is nearest to 1 / 255.
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

// What an image of that format would give back of a value: for passes that stand for several, so
// that their picture is that of the passes they spare.
vec3 as_stored(vec3 value, int format)
{
    if (format == STORED_UNORM8 || format == STORED_UNORM8_SCALED)
        return from_level(nearest_level(value), format);
    if (format == STORED_HALF)
        return nearest_half(clamp(value, -HALF_LIMIT, HALF_LIMIT));
    return clamp(value, -SINGLE_LIMIT, SINGLE_LIMIT);
}
