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

float group_luminance(vec4 value)
{
    return max(dot(value.rgb, LUMINANCE), 0.0);
}

float brightest(vec3 value)
{
    return max(max(value.r, max(value.g, value.b)), 0.0);
}

// The pyramid's firefly filter: brighter groups weigh less (Karis 2013).
vec4 pyramid_groups(Taps taps)
{
    vec4 means[5] = group_means(taps);
    vec4 sum = vec4(0.0);
    float shares = 0.0;
    [[unroll]] for (int group = 0; group < 5; ++group) {
        float share = GROUP_SHARES[group] / (1.0 + group_luminance(means[group]));
        sum += share * means[group];
        shares += share;
    }
    return sum / shares;
}

// What is not finite is 0.
vec4 usual(vec4 value)
{
    return mix(vec4(0.0), value,
               notEqual(floatBitsToUint(value) & 0x7f800000u, uvec4(0x7f800000u)));
}

// pygfx' weights of negative luminances are above 1, and beyond -1 negative. What is not finite is 0.
vec4 pygfx_mean(Taps taps)
{
    vec4 means[5] = group_means(taps);
    vec4 sum = vec4(0.0);
    float shares = 0.0;
    [[unroll]] for (int group = 0; group < 5; ++group) {
        float luminance = dot(means[group].rgb, LUMINANCE);
        float share = GROUPS == GROUPS_PYGFX_KARIS ? 1.0 / (1.0 + luminance) : GROUP_SHARES[group];
        sum += share * means[group];
        shares += share;
    }
    return usual(sum / shares);
}

vec4 pygfx_groups(Taps taps)
{
    return max(pygfx_mean(taps), vec4(0.0));
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

// A box of 4 x 4 texels as four taps, weighted by brightness and renormalized
// (Karis 2013; keijiro/KinoBloom @ 0a04c43fa47d, Bloom.cginc).
vec4 box_of(vec4 taps[4])
{
    vec4 sum = vec4(0.0);
    float shares = 0.0;
    [[unroll]] for (int corner = 0; corner < 4; ++corner) {
        float share = 1.0 / (1.0 + brightest(taps[corner].rgb));
        sum += share * taps[corner];
        shares += share;
    }
    return sum / shares;
}

vec4 combined(Taps taps)
{
    if (GROUPS == GROUPS_PYGFX || GROUPS == GROUPS_PYGFX_KARIS)
        return pygfx_groups(taps);
    if (GROUPS == GROUPS_BLENDER)
        return blender_groups(taps);
    return GROUPS == GROUPS_BOX ? box_of(taps.inner) : pyramid_groups(taps);
}
