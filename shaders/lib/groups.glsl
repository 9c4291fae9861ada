// What downsamplings make of 13 taps, or of the four inner ones. Some weight them by brightness,
// against fireflies.

// The outer taps in three rows, and the inner ones in two.
struct Taps {
    vec4 outer[9], inner[4];
};

const float GROUP_SHARES[5] = float[](0.5, 0.125, 0.125, 0.125, 0.125);

// The taps as five groups of four; the middle one has half of the weight.
vec4[5] group_means(Taps taps)
{
    vec4 a = taps.outer[0], b = taps.outer[1], c = taps.outer[2];
    vec4 d = taps.outer[3], e = taps.outer[4], f = taps.outer[5];
    vec4 g = taps.outer[6], h = taps.outer[7], i = taps.outer[8];
    vec4 inner = taps.inner[0] + taps.inner[1] + taps.inner[2] + taps.inner[3];
    return vec4[](0.25 * inner, 0.25 * (a + b + d + e), 0.25 * (b + c + e + f),
                  0.25 * (d + e + g + h), 0.25 * (e + f + h + i));
}

const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722);

// Of sRGB's primaries with more digits.
const vec3 LONG_LUMINANCE = vec3(0.2126729, 0.7151522, 0.0721750);

float group_luminance(vec4 value)
{
    return max(dot(value.rgb, LUMINANCE), 0.0);
}

float brightest(vec3 value)
{
    return max(max(value.r, max(value.g, value.b)), 0.0);
}

// The brightness by which a group weighs less, against fireflies (Karis 2013).
float brightness_of(vec4 mean)
{
    if (GROUPS == GROUPS_PYGFX)
        return 0.0;
    // Its weights of negative luminances are above 1, and beyond -1 negative.
    if (GROUPS == GROUPS_PYGFX_KARIS)
        return dot(mean.rgb, LUMINANCE);
    if (GROUPS == GROUPS_FILAMENT)
        return THRESHOLDED != 0 ? brightest(mean.rgb) : 0.0;
    if (GROUPS == GROUPS_BOX)
        return brightest(mean.rgb);
    return max(dot(mean.rgb, GROUPS == GROUPS_HDRP ? LONG_LUMINANCE : LUMINANCE), 0.0);
}

// A group's share without its brightness; `shares` are those of Filament's four.
float share_of(int group, vec4 shares)
{
    if (GROUPS == GROUPS_PYRAMID || GROUPS == GROUPS_PYGFX)
        return GROUP_SHARES[group];
    return GROUPS == GROUPS_FILAMENT ? shares[min(group, 3)] : 1.0;
}

vec4 weighted_mean(vec4 means[5], int count, vec4 shares)
{
    vec4 sum = vec4(0.0);
    float total = 0.0;
    [[unroll]] for (int group = 0; group < 5; ++group)
        if (group < count) {
            float share = share_of(group, shares) / (1.0 + brightness_of(means[group]));
            sum += share * means[group];
            total += share;
        }
    return sum / total;
}

// What is not finite is 0.
vec4 usual(vec4 value)
{
    return mix(vec4(0.0), value,
               notEqual(floatBitsToUint(value) & 0x7f800000u, uvec4(0x7f800000u)));
}

// A tap multiplied by its weight, and the weight.
struct Weighted {
    vec4 value;
    float weight;
};

Weighted weighted(vec4 value)
{
    float weight = 1.0 / (1.0 + max(value.r, max(value.g, value.b)));
    return Weighted(weight * value, weight);
}

vec4 mean(Weighted a, Weighted b, Weighted c, Weighted d)
{
    return (a.value + b.value + c.value + d.value) / (a.weight + b.weight + c.weight + d.weight);
}

// Blender's: within a group, brighter taps weigh less (formulas of the compositor of Blender 5.0). Taps
// between texels with negative channels may have a negative brightness.
vec4 blender_groups(Taps taps)
{
    Weighted a = weighted(taps.outer[0]), b = weighted(taps.outer[1]), c = weighted(taps.outer[2]);
    Weighted d = weighted(taps.outer[3]), e = weighted(taps.outer[4]), f = weighted(taps.outer[5]);
    Weighted g = weighted(taps.outer[6]), h = weighted(taps.outer[7]), i = weighted(taps.outer[8]);
    vec4 inner = mean(weighted(taps.inner[0]), weighted(taps.inner[1]), weighted(taps.inner[2]),
                      weighted(taps.inner[3]));
    vec4 outer = mean(a, b, d, e) + mean(b, c, e, f) + mean(d, e, g, h) + mean(e, f, h, i);
    return usual(0.5 * inner + 0.125 * outer);
}

vec4 combined(Taps taps)
{
    if (GROUPS == GROUPS_BLENDER)
        return blender_groups(taps);
    vec4 mean = weighted_mean(group_means(taps), 5, vec4(0.0));
    bool clamps = GROUPS == GROUPS_PYGFX || GROUPS == GROUPS_PYGFX_KARIS;
    return clamps ? max(usual(mean), vec4(0.0)) : mean;
}
