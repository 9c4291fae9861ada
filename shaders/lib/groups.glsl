// What downsamplings make of 13 taps, or of a few taps of their own. Some weight them by brightness,
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

// Not one expression: glslang 12 writes invalid SPIR-V for a condition of several constants.
bool are_of_thirteen()
{
    if (GROUPS == GROUPS_PYGFX)
        return true;
    if (GROUPS == GROUPS_PYGFX_KARIS)
        return true;
    return GROUPS == GROUPS_BEVY || GROUPS == GROUPS_PYRAMID;
}

// Whether each group is a tap of its own.
bool has_own_taps()
{
    return GROUPS != GROUPS_BLENDER && !are_of_thirteen();
}

// Of those that have one weight each. Blender's weights are those of the four taps of a group.
int group_count()
{
    if (are_of_thirteen())
        return 5;
    if (GROUPS == GROUPS_BOX)
        return 4;
    if (GROUPS == GROUPS_FILAMENT)
        return 4;
    if (GROUPS == GROUPS_BLENDER)
        return 4;
    if (GROUPS == GROUPS_KINO)
        return ANTI_FLICKER != 0 ? 5 : 1;
    return GROUPS == GROUPS_HDRP ? 5 : 1;
}

// A group's weight, and its derivatives by the channels.
struct Weight {
    float value;
    vec3 slope;
};

// Brighter groups weigh less (Karis 2013).
Weight weight_of(vec4 group, float share)
{
    bool by_brightest = GROUPS == GROUPS_BOX || GROUPS == GROUPS_FILAMENT;
    float gain = 1.0, brightness;
    vec3 slope = LUMINANCE;
    if (GROUPS == GROUPS_PYGFX)
        return Weight(share, vec3(0.0));
    if (GROUPS == GROUPS_FILAMENT && THRESHOLDED == 0)
        return Weight(share, vec3(0.0));
    if (GROUPS == GROUPS_HDRP)
        slope = vec3(0.2126729, 0.7151522, 0.0721750);
    // That of a group which has been multiplied by its share.
    if (GROUPS == GROUPS_BEVY)
        gain = 0.25 * share;
    if (by_brightest || GROUPS == GROUPS_BLENDER) {
        slope = shares_of_brightest(group.rgb);
        brightness = largest(group.rgb);
    } else {
        brightness = dot(group.rgb, slope);
    }
    // These two count negative brightness: beyond -1 weights are negative.
    if (GROUPS != GROUPS_PYGFX_KARIS && GROUPS != GROUPS_BLENDER) {
        slope *= larger(brightness, 0.0);
        brightness = max(brightness, 0.0);
    }
    float divisor = 1.0 + gain * brightness;
    return Weight(share / divisor, -gain * share / (divisor * divisor) * slope);
}

// The sum of groups with their weights, and the sum of the weights.
struct Sum {
    vec4 value;
    float weights;
};

Sum sum_of(vec4 groups[5], float shares[5])
{
    Sum sum = Sum(vec4(0.0), 0.0);
    [[unroll]] for (int group = 0; group < 5; ++group)
        if (group < group_count()) {
            float weight = weight_of(groups[group], shares[group]).value;
            sum.value += weight * groups[group];
            sum.weights += weight;
        }
    // Bevy's is not renormalized.
    if (GROUPS == GROUPS_BEVY)
        sum.weights = 1.0;
    return sum;
}

// What is not finite is 0.
vec4 usual(vec4 value)
{
    return mix(vec4(0.0), value,
               notEqual(floatBitsToUint(value) & 0x7f800000u, uvec4(0x7f800000u)));
}

const float ONES[5] = float[](1.0, 1.0, 1.0, 1.0, 1.0);

vec4 weighted_mean(vec4 a, vec4 b, vec4 c, vec4 d)
{
    Sum sum = sum_of(vec4[](a, b, c, d, vec4(0.0)), ONES);
    return sum.value / sum.weights;
}

// Blender's: within a group, brighter taps weigh less (formulas of the compositor of Blender 5.0). Taps
// between texels with negative channels may have a negative brightness.
vec4 blender_groups(Taps taps)
{
    vec4 a = taps.outer[0], b = taps.outer[1], c = taps.outer[2];
    vec4 d = taps.outer[3], e = taps.outer[4], f = taps.outer[5];
    vec4 g = taps.outer[6], h = taps.outer[7], i = taps.outer[8];
    vec4 inner = weighted_mean(taps.inner[0], taps.inner[1], taps.inner[2], taps.inner[3]);
    vec4 outer = weighted_mean(a, b, d, e) + weighted_mean(b, c, e, f) + weighted_mean(d, e, g, h)
               + weighted_mean(e, f, h, i);
    return usual(0.5 * inner + 0.125 * outer);
}
