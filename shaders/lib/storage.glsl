// Values that a shader writes to a target. They are clamped to the range of its format, since later
// passes would spread an infinity over the picture. They are rounded to the nearest half float, since
// some adapters (llvmpipe among them) truncate, which darkens the picture with every pass. They are
// rounded to the nearest 8-bit level, since some GPUs round values near the middle of two levels down.

#include "vkbloom/rounding.glsl"

// The value with a size of `limit` at the most, which is that of infinity, too. As integers, since
// llvmpipe takes three operations for each minimum and maximum of floats.
vec3 limited(vec3 value, float limit)
{
    uvec3 bits = floatBitsToUint(value);
    uvec3 size = min(bits & 0x7fffffffu, floatBitsToUint(limit));
    return uintBitsToFloat(size | (bits & 0x80000000u));
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
    if (format == STORED_SRGB8)
        return nearest_srgb(value);
    // Blending does not clamp, and a sum of the largest values must not overflow.
    return limited(value, SINGLE_LIMIT / float(max(EMITTERS, 1)));
}

vec3 storable(vec3 value)
{
#if defined(LINEAR_TEXELS) && CHANNEL_BYTES < 4
    // pixels.glsl rounds where it packs.
    return value;
#else
    // The device converts it back, so the error of one bit does not matter.
    if (STORED == STORED_UNORM8)
        return nearest_level(value) * (1.0 / 255.0);
    return as_stored(value, STORED);
#endif
}

// A value of a bloom buffer. Its alpha is 1, unless alpha is blurred like a colour. sRGB has a linear
// alpha.
vec4 stored(vec4 value)
{
    if (ALPHA != ALPHA_BLUR)
        return vec4(storable(value.rgb), 1.0);
    float alpha = STORED == STORED_SRGB8 ? nearest_level(value.aaa).r / 255.0 : storable(value.aaa).r;
    return vec4(storable(value.rgb), alpha);
}

vec4 as_stored(vec4 value, int format)
{
    return vec4(as_stored(value.rgb, format), as_stored(value.aaa, format).r);
}
