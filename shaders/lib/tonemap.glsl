// Tone maps and encodings of linear colours. A curve returns its value. It also takes cotangents, `by`, from
// those of its value to those of its argument.

// At kinks the derivative is the mean of both sides: of growing and of shrinking arguments. Each side is
// followed through all curves: the mean of a clamp of a clamp is not the product of their means.
bool growing = true;

// 1 above a kink, 0 below it.
vec3 above(vec3 value, float kink)
{
    return vec3(growing ? greaterThanEqual(value, vec3(kink)) : greaterThan(value, vec3(kink)));
}

vec3 below(vec3 value, float kink)
{
    return 1.0 - above(value, kink);
}

vec3 inside(vec3 value, float low, float high)
{
    return above(value, low) * below(value, high);
}

// The derivative of the power, 0 at a base of 0.
vec3 power_slope(vec3 base, float exponent)
{
    return mix(vec3(0.0), exponent * pow(max(base, 1e-38), vec3(exponent - 1.0)),
               greaterThan(base, vec3(0.0)));
}

// Reinhard et al. 2002, per channel.
vec3 tonemap_reinhard(vec3 c, inout vec3 by)
{
    // Where the result is infinite, the derivative is 0.
    by *= mix(vec3(0.0), 1.0 / (c + 1.0) / (c + 1.0), notEqual(c, vec3(-1.0)));
    return c / (c + 1.0);
}

// The fit of Narkowicz (2015) to the ACES reference curve.
vec3 tonemap_aces(vec3 c, inout vec3 by)
{
    // Outside of this range the curve exceeds 1 on both sides, and the squares would overflow.
    c = clamp(c, -65504.0, 65504.0);
    vec3 divisor = c * (2.43 * c + 0.59) + 0.14, value = c * (2.51 * c + 0.03) / divisor;
    by *= inside(value, 0.0, 1.0) * (5.02 * c + 0.03 - value * (4.86 * c + 0.59)) / divisor;
    return clamp(value, 0.0, 1.0);
}

vec3 tonemap_exponential(vec3 c, inout vec3 by)
{
    by *= mix(vec3(0.0), exp(-c), greaterThan(c, vec3(-88.0)));
    // Near 0, the first terms of the series: a difference of values near 1 loses precision.
    vec3 dark = c * (1.0 - c * (1.0 / 2.0 - c * (1.0 / 6.0 - c * (1.0 / 24.0))));
    return mix(1.0 - exp(-c), dark, lessThan(abs(c), vec3(1.0 / 32.0)));
}

// Khronos PBR Neutral tone mapper, specification 1.0.
vec3 tonemap_khronos_neutral(vec3 c, inout vec3 by)
{
    const float F90 = 0.04, START = 0.8 - F90, ROOM = 1.0 - START, DESATURATION = 0.15;
    // Lower values give the same result, 1, and their square would overflow.
    float low = max(min(c.r, min(c.g, c.b)), -1e15);
    bool dark = low < 2.0 * F90;
    // Encodings would magnify the rounding of an offset, low - low^2 / (4 F90).
    vec3 colour = dark ? c - low + low * low / (4.0 * F90) : c - F90, value = colour;
    float peak = largest(colour);
    if (peak >= START) {
        float apart = peak + ROOM - START, top = 1.0 - ROOM * ROOM / apart, ratio = top / peak;
        float kept = 1.0 / (DESATURATION * (peak - top) + 1.0);
        value = mix(colour * ratio, vec3(top), 1.0 - kept);
        float by_top = ROOM * ROOM / (apart * apart), by_ratio = (by_top - ratio) / peak;
        float by_kept = -kept * kept * DESATURATION * (1.0 - by_top);
        float by_peak = dot(by, colour) * (by_ratio * kept + ratio * by_kept)
                      + dot(by, vec3(1.0)) * (by_top * (1.0 - kept) - top * by_kept);
        by = ratio * kept * by + shares_of_brightest(colour) * by_peak;
    }
    if (dark)
        by -= shares_of_brightest(-c) * ((1.0 - low / (2.0 * F90)) * dot(by, vec3(1.0)));
    return value;
}

// AgX (Sobotka) in the variant of three.js (r160, tonemapping_pars_fragment): Rec. 2020 inset, log2
// range, sixth-order fit of the sigmoid, outset. The result is linear.
const mat3 REC709_TO_REC2020 =
    mat3(0.6274, 0.0691, 0.0164, 0.3293, 0.9195, 0.0880, 0.0433, 0.0113, 0.8956);
const mat3 REC2020_TO_REC709 =
    mat3(1.6605, -0.1246, -0.0182, -0.5876, 1.1329, -0.1006, -0.0728, -0.0083, 1.1187);
const mat3 AGX_INSET = mat3(0.856627153315983, 0.137318972929847, 0.11189821299995,
                            0.0951212405381588, 0.761241990602591, 0.0767994186031903,
                            0.0482516061458583, 0.101439036467562, 0.811302368396859);
const mat3 AGX_OUTSET = mat3(1.1271005818144368, -0.1413297634984383, -0.14132976349843826,
                             -0.11060664309660323, 1.157823702216272, -0.11060664309660294,
                             -0.016493938717834573, -0.016493938717834257, 1.2519364065950405);
const float AGX_LOW = -12.47393;
const float AGX_HIGH = 4.026069;

vec3 tonemap_agx(vec3 c, inout vec3 by)
{
    vec3 held = max(AGX_INSET * (REC709_TO_REC2020 * c), 1e-10);
    vec3 stops = (log2(held) - AGX_LOW) / (AGX_HIGH - AGX_LOW), x = clamp(stops, 0.0, 1.0);
    vec3 x2 = x * x, x4 = x2 * x2;
    vec3 contrast = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2
                  + 0.1191 * x - 0.00232;
    vec3 outset = AGX_OUTSET * contrast;
    vec3 value = REC2020_TO_REC709 * pow(max(outset, 0.0), vec3(2.2));
    // Step by step, from the last one to the first.
    by = by * inside(value, 0.0, 1.0) * REC2020_TO_REC709 * power_slope(outset, 2.2) * AGX_OUTSET;
    by *= 93.0 * x4 * x - 200.7 * x4 + 127.84 * x2 * x - 20.604 * x2 + 0.8596 * x + 0.1191;
    by *= inside(stops, 0.0, 1.0) / (held * (log(2.0) * (AGX_HIGH - AGX_LOW)));
    by = by * AGX_INSET * REC709_TO_REC2020;
    return clamp(value, 0.0, 1.0);
}

vec3 apply_tonemap(vec3 c, int tonemap, inout vec3 by)
{
    if (tonemap == TONEMAP_NONE)
        return c;
    // The exposure may have made it infinite, and huge divisors are not exact on every device.
    c = clamp(c, -1e30, 1e30);
    if (tonemap == TONEMAP_REINHARD)
        return tonemap_reinhard(c, by);
    if (tonemap == TONEMAP_ACES)
        return tonemap_aces(c, by);
    if (tonemap == TONEMAP_EXPONENTIAL)
        return tonemap_exponential(c, by);
    if (tonemap == TONEMAP_KHRONOS_NEUTRAL)
        return tonemap_khronos_neutral(c, by);
    return tonemap_agx(c, by);
}

vec3 apply_tonemap(vec3 c, int tonemap)
{
    vec3 none = vec3(0.0);
    return apply_tonemap(c, tonemap, none);
}

// Rec. ITU-R BT.2100-3, table 4: the inverse EOTF of luminances of 0 to 10000 cd/m2.
vec3 encode_pq(vec3 luminance, inout vec3 by)
{
    const float M1 = 2610.0 / 16384.0, M2 = 2523.0 / 32.0;
    const float C1 = 3424.0 / 4096.0, C2 = 2413.0 / 128.0, C3 = 2392.0 / 128.0;
    vec3 share = luminance / 10000.0, held = clamp(share, 0.0, 1.0), y = pow(held, vec3(M1));
    vec3 divisor = 1.0 + C3 * y, ratio = (C1 + C2 * y) / divisor;
    vec3 by_y = M2 * pow(ratio, vec3(M2 - 1.0)) * (C2 - C1 * C3) / (divisor * divisor);
    by *= inside(share, 0.0, 1.0) * by_y * power_slope(held, M1) / 10000.0;
    return pow(ratio, vec3(M2));
}

// Table 5: the OETF. A signal of 0.75 is the reference white, 1 here.
vec3 encode_hlg(vec3 c, inout vec3 by)
{
    const float A = 0.17883277, B = 0.28466892, C = 0.55991073, WHITE = 0.26496;
    vec3 e = WHITE * c, held = clamp(e, 0.0, 1.0);
    bvec3 bright = greaterThan(held, vec3(1.0 / 12.0));
    // The logarithm is not chosen below 1/12, but its argument must be positive there, too.
    vec3 base = 12.0 * max(held, 1.0 / 12.0) - B;
    by *= WHITE * inside(e, 0.0, 1.0) * mix(sqrt(3.0) * power_slope(held, 0.5), 12.0 * A / base, bright);
    return mix(sqrt(3.0 * held), A * log(base) + C, bright);
}

vec3 apply_encoding(vec3 c, int encoding, float reference_white, inout vec3 by)
{
    if (encoding == ENCODING_PQ) {
        by *= reference_white;
        return encode_pq(c * reference_white, by);
    }
    if (encoding == ENCODING_HLG)
        return encode_hlg(c, by);
    if (encoding == ENCODING_GAMMA22) {
        by *= power_slope(c, 1.0 / 2.2);
        return pow(max(c, 0.0), vec3(1.0 / 2.2));
    }
    if (encoding == ENCODING_SRGB) {
        by *= 12.92 * inside(c, 0.0, 0.0031308)
            + above(c, 0.0031308) * 1.055 * power_slope(c, 1.0 / 2.4);
        c = max(c, 0.0);
        // IEC 61966-2-1.
        return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055,
                   greaterThan(c, vec3(0.0031308)));
    }
    return c;
}

vec3 apply_encoding(vec3 c, int encoding, float reference_white)
{
    vec3 none = vec3(0.0);
    return apply_encoding(c, encoding, reference_white, none);
}
