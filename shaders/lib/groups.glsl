// What downsamplings make of 13 taps, or of a few taps of their own. Some weight them by brightness,
// against fireflies.

// The outer taps in three rows, and the inner ones in two.
struct Taps {
    vec4 outer[9], inner[4];
};

const float GROUP_SHARES[5] = float[](0.5, 0.125, 0.125, 0.125, 0.125);

// The taps of a group: the inner ones, or those at a corner.
vec4[4] taps_of_group(Taps taps, int group)
{
    int first = group < 3 ? group - 1 : group;
    if (group == 0)
        return taps.inner;
    return vec4[](taps.outer[first], taps.outer[first + 1], taps.outer[first + 3], taps.outer[first + 4]);
}

// The weight of taps or of a group, and its derivatives by the channels.
struct Weight {
    float value;
    vec3 slope;
};

Weight blender_weight(vec4 tap)
{
    float weight = 1.0 / (1.0 + largest(tap.rgb));
    return Weight(weight, -weight * weight * shares_of_brightest(tap.rgb));
}

// Blender's: within a group, brighter taps weigh less (formulas of the compositor of Blender 5.0). Taps
// between texels with negative channels may have a negative brightness.
vec4 blender_mean(vec4 taps[4])
{
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    [[unroll]] for (int i = 0; i < 4; ++i) {
        float weight = blender_weight(taps[i]).value;
        sum += weight * taps[i];
        weights += weight;
    }
    return sum / weights;
}

// The taps as five groups of four; the middle one has half of the weight.
vec4[5] group_means(Taps taps)
{
    vec4 means[5];
    [[unroll]] for (int group = 0; group < 5; ++group) {
        vec4 four[4] = taps_of_group(taps, group);
        means[group] = GROUPS == GROUPS_BLENDER ? blender_mean(four)
                                                : 0.25 * (four[0] + four[1] + four[2] + four[3]);
    }
    return means;
}

// Not one expression: glslang 12 writes invalid SPIR-V for a condition of several constants.
bool are_of_thirteen()
{
    if (GROUPS == GROUPS_PYGFX)
        return true;
    if (GROUPS == GROUPS_PYGFX_KARIS)
        return true;
    if (GROUPS == GROUPS_BLENDER)
        return true;
    return GROUPS == GROUPS_BEVY || GROUPS == GROUPS_PYRAMID;
}

int group_count()
{
    if (are_of_thirteen())
        return 5;
    if (GROUPS == GROUPS_BOX)
        return 4;
    if (GROUPS == GROUPS_FILAMENT)
        return 4;
    if (GROUPS == GROUPS_KINO)
        return ANTI_FLICKER != 0 ? 5 : 1;
    return GROUPS == GROUPS_HDRP ? 5 : 1;
}

// Brighter groups weigh less (Karis 2013).
Weight weight_of(vec4 group, float share)
{
    float gain = 1.0, brightness;
    vec3 slope = LUMINANCE;
    if (GROUPS == GROUPS_PYGFX || GROUPS == GROUPS_BLENDER)
        return Weight(share, vec3(0.0));
    if (GROUPS == GROUPS_FILAMENT && THRESHOLDED == 0)
        return Weight(share, vec3(0.0));
    if (GROUPS == GROUPS_HDRP)
        slope = vec3(0.2126729, 0.7151522, 0.0721750);
    // That of a group which has been multiplied by its share.
    if (GROUPS == GROUPS_BEVY)
        gain = 0.25 * share;
    if (GROUPS == GROUPS_BOX || GROUPS == GROUPS_FILAMENT) {
        slope = shares_of_brightest(group.rgb);
        brightness = largest(group.rgb);
    } else {
        brightness = dot(group.rgb, slope);
    }
    // pygfx counts negative brightness: beyond -1 weights are negative.
    if (GROUPS != GROUPS_PYGFX_KARIS) {
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

bvec4 is_usual(vec4 value)
{
    return notEqual(floatBitsToUint(value) & 0x7f800000u, uvec4(0x7f800000u));
}

// What is not finite is 0.
vec4 usual(vec4 value)
{
    return mix(vec4(0.0), value, is_usual(value));
}

const float ONES[5] = float[](1.0, 1.0, 1.0, 1.0, 1.0);
