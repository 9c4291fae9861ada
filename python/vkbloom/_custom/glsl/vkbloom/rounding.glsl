// The nearest values that the formats of images hold. Both the package's shaders and custom methods
// include this.
//
//   nearest_half(vec3)    the nearest half floats, ties to even; at most 65504
//   nearest_level(vec3)   the nearest of the levels 0 to 255 of values in 0..1
//   nearest_ufloat(vec3)  the nearest values of R11G11B10
//   nearest_srgb(vec3)    of values in 0..1 the light of the nearest levels of 8-bit sRGB

// What to add to a size for its last bit to have the weight of the nearest half float's: the power of
// two 13 places higher. That of subnormal half floats is one for all.
uvec3 half_magic(uvec3 size)
{
    return max(size & 0x7f800000u, 0x38800000u) + (13u << 23);
}

uvec3 half_size(vec3 value)
{
    return min(floatBitsToUint(value) & 0x7fffffffu, floatBitsToUint(65504.0));
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
#ifdef LINEAR_TEXELS
    // Shaders of CPUs limit as integers: of floats llvmpipe takes three operations for each minimum and maximum, because
    // of NaN. Those that x86 makes are negative, so they become 0, too.
    vec3 share = intBitsToFloat(clamp(floatBitsToInt(value), ivec3(0), ivec3(floatBitsToInt(1.0))));
#else
    vec3 share = clamp(value, 0.0, 1.0);
#endif
    return roundEven(255.0 * share);
}

vec3 nearest_srgb(vec3 value)
{
    vec3 light = clamp(value, 0.0, 1.0);
    vec3 share = mix(1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, 12.92 * light,
                     lessThanEqual(light, vec3(0.0031308)));
    share = roundEven(255.0 * share) / 255.0;
    return mix(pow((share + 0.055) / 1.055, vec3(2.4)), share / 12.92,
               lessThanEqual(share, vec3(0.04045)));
}

// The nearest floats with 5 bits of exponent and 6 of mantissa (of blue 5), ties to even: what images
// of R11G11B10 hold. Negative values and NaN become 0. Larger values become the largest one.
vec3 nearest_ufloat(vec3 value)
{
    const uvec3 dropped = uvec3(17, 17, 18);
    // The smallest normal value, 2^-14. Below it the steps are constant.
    const float MIN_NORMAL = 6.103515625e-5;
    const vec3 steps = vec3(1048576.0, 1048576.0, 524288.0);
    vec3 kept = mix(vec3(0.0), min(value, vec3(65024.0, 65024.0, 64512.0)),
                    greaterThan(value, vec3(0.0)));
    uvec3 bits = floatBitsToUint(kept);
    bits += (uvec3(1) << (dropped - 1u)) - 1u + ((bits >> dropped) & 1u);
    vec3 normal = uintBitsToFloat((bits >> dropped) << dropped);
    return mix(normal, roundEven(kept * steps) / steps, lessThan(kept, vec3(MIN_NORMAL)));
}
