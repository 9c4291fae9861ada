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

// The nearest floats with 5 bits of exponent and 6 of mantissa (of blue 5), ties to even: what images
// of R11G11B10 hold. Negative values and NaN become 0, what is larger than the largest becomes that.
vec3 nearest_ufloat(vec3 value)
{
    const uvec3 dropped = uvec3(17, 17, 18);
    // The least normal one, 2^-14; below it the steps stay the same.
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
    if (format == STORED_UFLOAT)
        return nearest_ufloat(value);
    return value;
}
