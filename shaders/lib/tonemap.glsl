// Tone maps and encodings of linear colours.

// Reinhard et al. 2002, per channel.
vec3 tonemap_reinhard(vec3 c)
{
    return c / (c + 1.0);
}

// The fit of Narkowicz (2015) to the ACES reference curve.
vec3 tonemap_aces(vec3 c)
{
    // Outside of this range the curve exceeds 1 on both sides, and the squares would overflow.
    c = clamp(c, -65504.0, 65504.0);
    return clamp(c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14), 0.0, 1.0);
}

vec3 tonemap_exponential(vec3 c)
{
    // Near 0, the first terms of the series: a difference of values near 1 loses precision.
    vec3 dark = c * (1.0 - c * (1.0 / 2.0 - c * (1.0 / 6.0 - c * (1.0 / 24.0))));
    return mix(1.0 - exp(-c), dark, lessThan(abs(c), vec3(1.0 / 32.0)));
}

// Khronos PBR Neutral tone mapper, specification 1.0.
const float F90 = 0.04;

vec3 khronos_compressed(vec3 c)
{
    const float COMPRESSION_START = 0.8 - F90;
    const float DESATURATION = 0.15;
    float peak = max(c.r, max(c.g, c.b));
    if (peak < COMPRESSION_START)
        return c;
    float room = 1.0 - COMPRESSION_START;
    float compressed = 1.0 - room * room / (peak + room - COMPRESSION_START);
    c *= compressed / peak;
    float white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    return mix(c, vec3(compressed), white);
}

vec3 tonemap_khronos_neutral(vec3 c)
{
    // Lower values give the same result, 1, and their square would overflow.
    float low = max(min(c.r, min(c.g, c.b)), -1e15);
    float offset = low < 2.0 * F90 ? low - low * low / (4.0 * F90) : F90;
    return khronos_compressed(c - offset);
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

vec3 agx_contrast(vec3 x)
{
    vec3 x2 = x * x;
    vec3 x4 = x2 * x2;
    return 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x
         - 0.00232;
}

vec3 tonemap_agx(vec3 c)
{
    vec3 x = max(AGX_INSET * (REC709_TO_REC2020 * c), 1e-10);
    x = agx_contrast(clamp((log2(x) - AGX_LOW) / (AGX_HIGH - AGX_LOW), 0.0, 1.0));
    x = AGX_OUTSET * x;
    x = pow(max(x, 0.0), vec3(2.2));
    return clamp(REC2020_TO_REC709 * x, 0.0, 1.0);
}

vec3 apply_tonemap(vec3 c, int tonemap)
{
    if (tonemap == TONEMAP_NONE)
        return c;
    // The exposure may have made it infinite, and huge divisors are not exact on every device.
    c = clamp(c, -1e30, 1e30);
    if (tonemap == TONEMAP_REINHARD)
        return tonemap_reinhard(c);
    if (tonemap == TONEMAP_ACES)
        return tonemap_aces(c);
    if (tonemap == TONEMAP_EXPONENTIAL)
        return tonemap_exponential(c);
    if (tonemap == TONEMAP_KHRONOS_NEUTRAL)
        return tonemap_khronos_neutral(c);
    return tonemap_agx(c);
}

// Rec. ITU-R BT.2100-3, table 4: the inverse EOTF of luminances of 0 to 10000 cd/m2.
vec3 encode_pq(vec3 luminance)
{
    const float M1 = 2610.0 / 16384.0, M2 = 2523.0 / 32.0;
    const float C1 = 3424.0 / 4096.0, C2 = 2413.0 / 128.0, C3 = 2392.0 / 128.0;
    vec3 y = pow(clamp(luminance / 10000.0, 0.0, 1.0), vec3(M1));
    return pow((C1 + C2 * y) / (1.0 + C3 * y), vec3(M2));
}

// Table 5: the OETF. A signal of 0.75 is the reference white, 1 here.
vec3 encode_hlg(vec3 c)
{
    const float A = 0.17883277, B = 0.28466892, C = 0.55991073, WHITE = 0.26496;
    vec3 e = clamp(WHITE * c, 0.0, 1.0);
    // The logarithm is not chosen below 1/12, but its argument must be positive there, too.
    return mix(sqrt(3.0 * e), A * log(12.0 * max(e, 1.0 / 12.0) - B) + C,
               greaterThan(e, vec3(1.0 / 12.0)));
}

vec3 apply_encoding(vec3 c, int encoding, float reference_white)
{
    if (encoding == ENCODING_PQ)
        return encode_pq(c * reference_white);
    if (encoding == ENCODING_HLG)
        return encode_hlg(c);
    if (encoding == ENCODING_GAMMA22)
        return pow(max(c, 0.0), vec3(1.0 / 2.2));
    if (encoding == ENCODING_SRGB) {
        c = max(c, 0.0);
        // IEC 61966-2-1.
        return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055,
                   greaterThan(c, vec3(0.0031308)));
    }
    return c;
}
