// Cotangents through tone maps and encodings (tonemap.glsl): of a curve's argument from those of its
// result. At kinks, the derivative is the mean of both sides. Each side is followed through all curves:
// the mean of a clamp of a clamp is not the product of their means. The columns of a matrix are those of the
// growing and of the shrinking side. Equal channels have equal shares.

vec4 mean_of_sides(mat2x4 sides)
{
    return mix(0.5 * (sides[0] + sides[1]), sides[0], equal(sides[0], sides[1]));
}

mat2x3 times(mat2x3 sides, vec3 factor)
{
    return mat2x3(sides[0] * factor, sides[1] * factor);
}

vec2 dots(mat2x3 sides, vec3 value)
{
    return vec2(dot(sides[0], value), dot(sides[1], value));
}

vec2 first_row(mat2x3 sides)
{
    return vec2(sides[0].x, sides[1].x);
}

mat2x4 with_alpha(mat2x3 colour, vec2 alpha)
{
    return mat2x4(vec4(colour[0], alpha.x), vec4(colour[1], alpha.y));
}

// 1 above a kink, 0 below it.
mat2x3 above(vec3 value, float kink)
{
    return mat2x3(vec3(greaterThanEqual(value, vec3(kink))), vec3(greaterThan(value, vec3(kink))));
}

mat2x3 below(vec3 value, float kink)
{
    return mat2x3(vec3(lessThan(value, vec3(kink))), vec3(lessThanEqual(value, vec3(kink))));
}

mat2x3 inside(vec3 value, float low, float high)
{
    return matrixCompMult(above(value, low), below(value, high));
}

vec3 equal_shares(vec3 value, float extreme)
{
    vec3 share = vec3(equal(value, vec3(extreme)));
    return share / (share.r + share.g + share.b);
}

mat2x3 back_aces(vec3 c, mat2x3 cotangents)
{
    vec3 divisor = c * (2.43 * c + 0.59) + 0.14, value = c * (2.51 * c + 0.03) / divisor;
    return times(matrixCompMult(cotangents, inside(value, 0.0, 1.0)),
                 (5.02 * c + 0.03 - value * (4.86 * c + 0.59)) / divisor);
}

// The tone map without its differences near 0, since encodings are so steep there that the rounding of
// a difference would change their slopes.
vec3 exactly_toned(vec3 c, int tonemap)
{
    float low = min(c.r, min(c.g, c.b));
    if (tonemap != TONEMAP_KHRONOS_NEUTRAL || abs(low) >= 2.0 * F90)
        return apply_tonemap(c, tonemap);
    return khronos_compressed(min(c, 1e30) - low + low * low / (4.0 * F90));
}

mat2x3 back_khronos_neutral(vec3 c, mat2x3 cotangents)
{
    const float START = 0.8 - F90, ROOM = 1.0 - START, DESATURATION = 0.15;
    float low = min(c.r, min(c.g, c.b));
    bool dark = low <= 2.0 * F90;
    float offset = dark ? low - low * low / (4.0 * F90) : F90;
    vec3 colour = c - offset;
    mat2x3 by_colour = cotangents;
    float peak = max(colour.r, max(colour.g, colour.b));
    if (peak > START) {
        float apart = peak + ROOM - START, top = 1.0 - ROOM * ROOM / apart;
        float by_top = ROOM * ROOM / (apart * apart);
        float kept = 1.0 / (DESATURATION * (peak - top) + 1.0);
        float by_kept = -kept * kept * DESATURATION * (1.0 - by_top);
        float ratio = top / peak, by_ratio = (by_top - ratio) / peak;
        vec2 by_peak = dots(cotangents, colour) * (by_ratio * kept + ratio * by_kept)
                     + dots(cotangents, vec3(1.0)) * (by_top * (1.0 - kept) - top * by_kept);
        by_colour = ratio * kept * cotangents + outerProduct(equal_shares(colour, peak), by_peak);
    }
    float slope = dark ? 1.0 - low / (2.0 * F90) : 0.0;
    return by_colour - outerProduct(equal_shares(c, low), slope * dots(by_colour, vec3(1.0)));
}

// Step by step, from the last one to the first.
mat2x3 back_agx(vec3 c, mat2x3 cotangents)
{
    vec3 mixed = AGX_INSET * (REC709_TO_REC2020 * c), held = max(mixed, 1e-10);
    vec3 stops = (log2(held) - AGX_LOW) / (AGX_HIGH - AGX_LOW), x = clamp(stops, 0.0, 1.0);
    vec3 outset = AGX_OUTSET * agx_contrast(x), base = max(outset, 0.0);
    vec3 power = 2.2 * pow(base, vec3(1.2)) * vec3(greaterThan(outset, vec3(0.0)));
    mat2x3 by =
        matrixCompMult(cotangents, inside(REC2020_TO_REC709 * pow(base, vec3(2.2)), 0.0, 1.0));
    by = times(transpose(REC2020_TO_REC709) * by, power);
    vec3 x2 = x * x, x3 = x2 * x;
    vec3 slope = 93.0 * x3 * x2 - 200.7 * x2 * x2 + 127.84 * x3 - 20.604 * x2 + 0.8596 * x + 0.1191;
    by = matrixCompMult(times(transpose(AGX_OUTSET) * by, slope), inside(stops, 0.0, 1.0));
    by = times(by, vec3(greaterThan(mixed, vec3(1e-10))) / (held * (log(2.0) * (AGX_HIGH - AGX_LOW))));
    return transpose(REC709_TO_REC2020) * (transpose(AGX_INSET) * by);
}

mat2x3 back_through_tonemap(vec3 c, mat2x3 cotangents, int tonemap)
{
    if (tonemap == TONEMAP_NONE)
        return cotangents;
    c = clamp(c, -1e30, 1e30);
    // Where the result is infinite, the derivative is 0.
    if (tonemap == TONEMAP_REINHARD)
        return times(cotangents,
                     mix(vec3(0.0), 1.0 / (c + 1.0) / (c + 1.0), notEqual(c, vec3(-1.0))));
    if (tonemap == TONEMAP_ACES)
        return back_aces(clamp(c, -65504.0, 65504.0), cotangents);
    if (tonemap == TONEMAP_EXPONENTIAL)
        return times(cotangents, mix(vec3(0.0), exp(-c), greaterThan(c, vec3(-88.0))));
    if (tonemap == TONEMAP_KHRONOS_NEUTRAL)
        return back_khronos_neutral(c, cotangents);
    return back_agx(c, cotangents);
}

// The derivative of the power, 0 at a base of 0.
vec3 power_slope(vec3 base, float exponent)
{
    return mix(vec3(0.0), exponent * pow(max(base, 1e-38), vec3(exponent - 1.0)),
               greaterThan(base, vec3(0.0)));
}

mat2x3 pq_slope(vec3 luminance)
{
    const float M1 = 2610.0 / 16384.0, M2 = 2523.0 / 32.0;
    const float C1 = 3424.0 / 4096.0, C2 = 2413.0 / 128.0, C3 = 2392.0 / 128.0;
    vec3 share = luminance / 10000.0, held = clamp(share, 0.0, 1.0), y = pow(held, vec3(M1));
    vec3 ratio = (C1 + C2 * y) / (1.0 + C3 * y);
    vec3 by_y = M2 * pow(ratio, vec3(M2 - 1.0)) * (C2 - C1 * C3) / ((1.0 + C3 * y) * (1.0 + C3 * y));
    return times(inside(share, 0.0, 1.0), by_y * power_slope(held, M1) / 10000.0);
}

mat2x3 hlg_slope(vec3 c)
{
    const float A = 0.17883277, B = 0.28466892, WHITE = 0.26496;
    vec3 e = WHITE * c, held = clamp(e, 0.0, 1.0);
    vec3 slope = mix(sqrt(3.0) * power_slope(held, 0.5),
                     12.0 * A / (12.0 * max(held, 1.0 / 12.0) - B),
                     greaterThan(held, vec3(1.0 / 12.0)));
    return times(inside(e, 0.0, 1.0), WHITE * slope);
}

// The derivatives by each channel.
mat2x3 encoding_slope(vec3 c, int encoding, float reference_white)
{
    if (encoding == ENCODING_PQ)
        return reference_white * pq_slope(c * reference_white);
    if (encoding == ENCODING_HLG)
        return hlg_slope(c);
    mat2x3 slope = mat2x3(vec3(1.0), vec3(1.0));
    if (encoding == ENCODING_GAMMA22)
        return times(slope, power_slope(c, 1.0 / 2.2));
    if (encoding == ENCODING_SRGB)
        return 12.92 * inside(c, 0.0, 0.0031308)
             + times(above(c, 0.0031308), 1.055 * power_slope(c, 1.0 / 2.4));
    return slope;
}
