// Values that a shader writes to a target. They are clamped to the range of its format, since later
// passes would spread an infinity over the picture. They are rounded to the nearest half float, since
// some adapters (llvmpipe among them) truncate, which darkens the picture with every pass. They are
// rounded to the nearest 8-bit level, since some GPUs round values near the middle of two levels down.

// The value with a size of `limit` at the most, which is that of infinity, too. As integers, since
// llvmpipe takes three operations for each minimum and maximum of floats.
vec3 limited(vec3 value, float limit)
{
    uvec3 bits = floatBitsToUint(value);
    uvec3 size = min(bits & 0x7fffffffu, floatBitsToUint(limit));
    return uintBitsToFloat(size | (bits & 0x80000000u));
}

// What to add to a size for its last bit to have the weight of the nearest half float's: the power of
// two 13 places higher. That of subnormal half floats is one for all.
uvec3 half_magic(uvec3 size)
{
    return max(size & 0x7f800000u, 0x38800000u) + (13u << 23);
}

uvec3 half_size(vec3 value)
{
    return min(floatBitsToUint(value) & 0x7fffffffu, floatBitsToUint(HALF_LIMIT));
}

// The nearest half float, ties to even, including subnormal ones.
vec3 nearest_half(vec3 value)
{
    uvec3 size = half_size(value);
    vec3 magic = uintBitsToFloat(half_magic(size));
    uvec3 nearest = floatBitsToUint((uintBitsToFloat(size) + magic) - magic);
    // Keep the sign of zero.
    return uintBitsToFloat(nearest | (floatBitsToUint(value) & 0x80000000u));
}

// Its 16 bits: after the sum its mantissa stands at the end of that of `magic`.
uvec3 nearest_half_bits(vec3 value)
{
    uvec3 size = half_size(value), magic = half_magic(size);
    uvec3 sum = floatBitsToUint(uintBitsToFloat(size) + uintBitsToFloat(magic));
    return (sum - magic + (magic >> 13) - (126u << 10)) | (floatBitsToUint(value) >> 16 & 0x8000u);
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
#if defined(WORDS) && CHANNEL_BYTES < 4
    // pixels.glsl rounds where it packs.
    return value;
#else
    if (STORED == STORED_UFLOAT)
        return nearest_ufloat(value);
    // The device converts it back, so the error of one bit does not matter.
    if (STORED == STORED_UNORM8)
        return nearest_level(value) * (1.0 / 255.0);
    return STORED == STORED_HALF ? nearest_half(value) : limited(value, params.limit);
#endif
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
        return nearest_half(value);
    if (format == STORED_UFLOAT)
        return nearest_ufloat(value);
    return limited(value, SINGLE_LIMIT);
}

vec4 as_stored(vec4 value, int format)
{
    return vec4(as_stored(value.rgb, format), as_stored(value.aaa, format).r);
}
