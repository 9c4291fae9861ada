// Cotangents through tone maps and encodings (tonemap.glsl): of a curve's argument from those of its
// result. At kinks, the derivative is the mean of both sides. Each side is followed through all curves:
// the mean of a clamp of a clamp is not the product of their means. Both are computed always, since a loop
// over them is slow: what they share is computed once. Equal channels have equal shares.

// The side that is followed.
bool growing;

vec4 mean_of_sides(vec4 grown, vec4 shrunk)
{
    return mix(0.5 * (grown + shrunk), grown, equal(grown, shrunk));
}

// 1 above a kink, 0 below it.
vec3 above(vec3 value, float kink)
{
    return growing ? vec3(greaterThanEqual(value, vec3(kink))) : vec3(greaterThan(value, vec3(kink)));
}

vec3 inside(vec3 value, float low, float high)
{
    return above(value, low) * (1.0 - above(value, high));
}

vec3 equal_shares(vec3 value, float extreme)
{
    vec3 share = vec3(equal(value, vec3(extreme)));
    return share / (share.r + share.g + share.b);
}

vec3 back_aces(vec3 c, vec3 cotangent)
{
    vec3 divisor = c * (2.43 * c + 0.59) + 0.14, value = c * (2.51 * c + 0.03) / divisor;
    return cotangent * inside(value, 0.0, 1.0) * (5.02 * c + 0.03 - value * (4.86 * c + 0.59)) / divisor;
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

vec3 back_khronos_neutral(vec3 c, vec3 cotangent)
{
    const float START = 0.8 - F90, ROOM = 1.0 - START, DESATURATION = 0.15;
    float low = min(c.r, min(c.g, c.b));
    bool dark = low <= 2.0 * F90;
    float offset = dark ? low - low * low / (4.0 * F90) : F90;
    vec3 colour = c - offset, by_colour = cotangent;
    float peak = max(colour.r, max(colour.g, colour.b));
    if (peak > START) {
        float apart = peak + ROOM - START, top = 1.0 - ROOM * ROOM / apart;
        float by_top = ROOM * ROOM / (apart * apart);
        float kept = 1.0 / (DESATURATION * (peak - top) + 1.0);
        float by_kept = -kept * kept * DESATURATION * (1.0 - by_top);
        float ratio = top / peak, by_ratio = (by_top - ratio) / peak;
        float by_peak = dot(cotangent, colour) * (by_ratio * kept + ratio * by_kept)
                      + dot(cotangent, vec3(1.0)) * (by_top * (1.0 - kept) - top * by_kept);
        by_colour = ratio * kept * cotangent + equal_shares(colour, peak) * by_peak;
    }
    float slope = dark ? 1.0 - low / (2.0 * F90) : 0.0;
    return by_colour - equal_shares(c, low) * (slope * dot(by_colour, vec3(1.0)));
}

// Step by step, from the last one to the first.
vec3 back_agx(vec3 c, vec3 cotangent)
{
    vec3 mixed = AGX_INSET * (REC709_TO_REC2020 * c), held = max(mixed, 1e-10);
    vec3 stops = (log2(held) - AGX_LOW) / (AGX_HIGH - AGX_LOW), x = clamp(stops, 0.0, 1.0);
    vec3 outset = AGX_OUTSET * agx_contrast(x), base = max(outset, 0.0);
    vec3 by = cotangent * inside(REC2020_TO_REC709 * pow(base, vec3(2.2)), 0.0, 1.0);
    by = (by * REC2020_TO_REC709) * 2.2 * pow(base, vec3(1.2)) * vec3(greaterThan(outset, vec3(0.0)));
    vec3 x2 = x * x, x3 = x2 * x;
    vec3 slope = 93.0 * x3 * x2 - 200.7 * x2 * x2 + 127.84 * x3 - 20.604 * x2 + 0.8596 * x + 0.1191;
    by = (by * AGX_OUTSET) * slope * inside(stops, 0.0, 1.0);
    by *= vec3(greaterThan(mixed, vec3(1e-10))) / (held * (log(2.0) * (AGX_HIGH - AGX_LOW)));
    return (by * AGX_INSET) * REC709_TO_REC2020;
}

vec3 back_through_tonemap(vec3 c, vec3 cotangent, int tonemap)
{
    if (tonemap == TONEMAP_NONE)
        return cotangent;
    c = clamp(c, -1e30, 1e30);
    // Where the result is infinite, the derivative is 0.
    if (tonemap == TONEMAP_REINHARD)
        return mix(vec3(0.0), cotangent / (c + 1.0) / (c + 1.0), notEqual(c, vec3(-1.0)));
    if (tonemap == TONEMAP_ACES)
        return back_aces(clamp(c, -65504.0, 65504.0), cotangent);
    if (tonemap == TONEMAP_EXPONENTIAL)
        return mix(vec3(0.0), cotangent * exp(-c), greaterThan(c, vec3(-88.0)));
    if (tonemap == TONEMAP_KHRONOS_NEUTRAL)
        return back_khronos_neutral(c, cotangent);
    return back_agx(c, cotangent);
}

// The derivative of the power, 0 at a base of 0.
vec3 power_slope(vec3 base, float exponent)
{
    return mix(vec3(0.0), exponent * pow(max(base, 1e-38), vec3(exponent - 1.0)),
               greaterThan(base, vec3(0.0)));
}

vec3 pq_slope(vec3 luminance)
{
    const float M1 = 2610.0 / 16384.0, M2 = 2523.0 / 32.0;
    const float C1 = 3424.0 / 4096.0, C2 = 2413.0 / 128.0, C3 = 2392.0 / 128.0;
    vec3 share = luminance / 10000.0, held = clamp(share, 0.0, 1.0), y = pow(held, vec3(M1));
    vec3 ratio = (C1 + C2 * y) / (1.0 + C3 * y);
    vec3 by_y = M2 * pow(ratio, vec3(M2 - 1.0)) * (C2 - C1 * C3) / ((1.0 + C3 * y) * (1.0 + C3 * y));
    return by_y * power_slope(held, M1) * inside(share, 0.0, 1.0) / 10000.0;
}

vec3 hlg_slope(vec3 c)
{
    const float A = 0.17883277, B = 0.28466892, WHITE = 0.26496;
    vec3 e = WHITE * c, held = clamp(e, 0.0, 1.0);
    vec3 slope = mix(sqrt(3.0) * power_slope(held, 0.5),
                     12.0 * A / (12.0 * max(held, 1.0 / 12.0) - B),
                     greaterThan(held, vec3(1.0 / 12.0)));
    return WHITE * slope * inside(e, 0.0, 1.0);
}

// The derivatives by each channel.
vec3 encoding_slope(vec3 c, int encoding, float reference_white)
{
    if (encoding == ENCODING_PQ)
        return reference_white * pq_slope(c * reference_white);
    if (encoding == ENCODING_HLG)
        return hlg_slope(c);
    if (encoding == ENCODING_GAMMA22)
        return power_slope(c, 1.0 / 2.2);
    if (encoding == ENCODING_SRGB)
        return mix(12.92 * above(c, 0.0), 1.055 * power_slope(c, 1.0 / 2.4), above(c, 0.0031308));
    return vec3(1.0);
}
