// What a shader writes to a target: kept inside the range of its format, for a value that overflowed
// to infinity would spread over the picture in the passes after it; and for half floats rounded to
// the nearest one, for some adapters (llvmpipe among them) cut the bits off, which makes a picture
// darker pass by pass.

vec3 nearest_half(vec3 value)
{
    uvec3 bits = floatBitsToUint(value);
    // 13 bits of the mantissa go; ties to even. Below the smallest normal half the step is coarser
    // than this, and nobody sees it.
    bits += 0xfffu + ((bits >> 13) & 1u);
    return uintBitsToFloat(bits & 0xffffe000u);
}

vec3 storable(vec3 value)
{
    vec3 kept = clamp(value, -params.limit, params.limit);
    return params.limit == HALF_LIMIT ? nearest_half(kept) : kept;
}

// What an image of that format would give back of a value: for passes that stand for several, so
// that their picture is that of the passes they spare.
vec3 as_stored(vec3 value, int format)
{
    if (format == STORED_UNORM8) {
        // Precise: a compiler may else take the factor out of the sums that follow, which then round
        // where those of texels do not.
        precise vec3 stored = roundEven(255.0 * clamp(value, 0.0, 1.0)) * (1.0 / 255.0);
        return stored;
    }
    if (format == STORED_HALF)
        return nearest_half(clamp(value, -HALF_LIMIT, HALF_LIMIT));
    return value;
}
