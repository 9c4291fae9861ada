// What becomes of the kernels of a set of taps (COMBINATIONS of params.h), and cotangents through it. Weights are
// against fireflies: brighter kernels weigh less (Karis 2013).

// The samples of a set, its kernels, their shares, and the sums of the weights of their taps.
struct Samples {
    vec4 taps[MAX_SET_TAPS], kernels[MAX_SET_KERNELS];
    float shares[MAX_SET_KERNELS], weights[MAX_SET_KERNELS];
};

// The weight of a value, and its derivatives by the channels: what a new average adds.
struct Weight {
    float value;
    vec3 slope;
};

Weight share_weight(vec4 value, float share)
{
    return Weight(share, vec3(0.0));
}

// 1 / (1 + gain * brightness) of a share. A negative brightness counts as 0.
Weight weight_by(float brightness, vec3 slope, float gain, float share)
{
    slope *= larger(brightness, 0.0);
    float divisor = 1.0 + gain * max(brightness, 0.0);
    return Weight(share / divisor, -gain * share / (divisor * divisor) * slope);
}

Weight karis_weight(vec4 value, float share)
{
    return weight_by(dot(value.rgb, LUMINANCE), LUMINANCE, 1.0, share);
}

Weight hdrp_weight(vec4 value, float share)
{
    const vec3 weights = vec3(0.2126729, 0.7151522, 0.0721750);
    return weight_by(dot(value.rgb, weights), weights, 1.0, share);
}

Weight brightest_weight(vec4 value, float share)
{
    return weight_by(largest(value.rgb), shares_of_brightest(value.rgb), 1.0, share);
}

// That of a kernel which has been multiplied by its share.
Weight bevy_weight(vec4 value, float share)
{
    return weight_by(dot(value.rgb, LUMINANCE), LUMINANCE, 0.25 * share, share);
}

// pygfx counts negative brightness, beyond -1 with negative weights. All kernels have the same share.
Weight pygfx_weight(vec4 value, float share)
{
    float divisor = 1.0 + dot(value.rgb, LUMINANCE);
    return Weight(1.0 / divisor, -1.0 / (divisor * divisor) * LUMINANCE);
}

// Formulas of the compositor of Blender 5.0. Taps between texels with negative channels may have a negative brightness.
Weight blender_weight(vec4 value, float share)
{
    float weight = 1.0 / (1.0 + largest(value.rgb));
    return Weight(weight, -weight * weight * shares_of_brightest(value.rgb));
}

// Selects with minimum and maximum only, since arithmetic would round.
vec4 middle(vec4 a, vec4 b, vec4 c)
{
    return max(min(a, b), min(max(a, b), c));
}

// The cotangents of the three values of a median.
vec4[3] back_middle(vec4 a, vec4 b, vec4 c, vec4 cotangent)
{
    vec4 low = min(a, b), high = max(a, b), held = min(high, c);
    vec4 by_low = cotangent * larger(low, held), by_held = cotangent * larger(held, low);
    vec4 by_high = by_held * larger(c, high);
    return vec4[](by_low * larger(b, a) + by_high * larger(a, b),
                  by_low * larger(a, b) + by_high * larger(b, a), by_held * larger(high, c));
}

// Kino's is the median of a texel and its neighbours, along both axes (keijiro/KinoBloom @ 0a04c43fa47d,
// Bloom.cginc).
vec4 median(Samples samples)
{
    vec4 k[5] = samples.kernels;
    return middle(middle(k[0], k[1], k[2]), k[3], k[4]);
}

vec4 back_median(Samples samples, int kernel, vec4 cotangent)
{
    vec4 k[5] = samples.kernels;
    vec4 columns[3] = back_middle(middle(k[0], k[1], k[2]), k[3], k[4], cotangent);
    vec4 rows[3] = back_middle(k[0], k[1], k[2], columns[0]);
    return kernel < 3 ? rows[kernel] : columns[kernel - 2];
}

// The weight of a kernel, and of a tap in its kernel.
#define CALL_WEIGHT(name, number, weight) \
    if (COMBINE == name) \
        return weight(value, share);
#define SKIP_COMBINATION(name, number, function)

Weight kernel_weight(vec4 value, float share)
{
    COMBINATIONS(CALL_WEIGHT, CALL_WEIGHT, SKIP_COMBINATION, SKIP_COMBINATION)
    return share_weight(value, share);
}

Weight tap_weight(vec4 value)
{
    const float share = 1.0;
    COMBINATIONS(SKIP_COMBINATION, SKIP_COMBINATION, CALL_WEIGHT, SKIP_COMBINATION)
    return share_weight(value, share);
}

#define IS_COMBINATION(name, number, function) \
    if (COMBINE == name) \
        return true;

// Whether the taps of a kernel have weights; whether the kernels' are not divided by their sum.
bool weighs_taps()
{
    COMBINATIONS(SKIP_COMBINATION, SKIP_COMBINATION, IS_COMBINATION, SKIP_COMBINATION)
    return false;
}

bool is_sum()
{
    COMBINATIONS(SKIP_COMBINATION, IS_COMBINATION, SKIP_COMBINATION, SKIP_COMBINATION)
    return false;
}

// A kernel of four taps, and the sum of their weights.
vec4 kernel_of(vec4 taps[4], out float weights)
{
    vec4 sum = vec4(0.0);
    weights = 4.0;
    if (!weighs_taps())
        return 0.25 * (taps[0] + taps[1] + taps[2] + taps[3]);
    weights = 0.0;
    [[unroll]] for (int i = 0; i < 4; ++i) {
        float weight = tap_weight(taps[i]).value;
        sum += weight * taps[i];
        weights += weight;
    }
    return sum / weights;
}

// The sum of the first `count` kernels with their weights, and the sum of these.
vec4 weighted_sum(Samples samples, int count, out float weights)
{
    vec4 sum = vec4(0.0);
    weights = 0.0;
    [[unroll]] for (int i = 0; i < MAX_SET_KERNELS; ++i)
        if (i < count) {
            float weight = kernel_weight(samples.kernels[i], samples.shares[i]).value;
            sum += weight * samples.kernels[i];
            weights += weight;
        }
    if (is_sum())
        weights = 1.0;
    return sum;
}

#define CALL_SELECT(name, number, function) \
    if (COMBINE == name) \
        return function(samples);
#define CALL_SELECT_SLOPE(name, number, function) \
    if (COMBINE == name) \
        return back_##function(samples, kernel, cotangent);

vec4 combined(Samples samples, int count)
{
    float weights;
    if (count == 1)
        return samples.kernels[0];
    COMBINATIONS(SKIP_COMBINATION, SKIP_COMBINATION, SKIP_COMBINATION, CALL_SELECT)
    vec4 sum = weighted_sum(samples, count, weights);
    return sum / weights;
}

// The cotangents of a kernel. By an average they depend on how far it is from this.
vec4 back_combined(Samples samples, int count, int kernel, vec4 cotangent)
{
    float weights;
    if (count == 1)
        return cotangent;
    COMBINATIONS(SKIP_COMBINATION, SKIP_COMBINATION, SKIP_COMBINATION, CALL_SELECT_SLOPE)
    vec4 sum = weighted_sum(samples, count, weights), own = samples.kernels[kernel];
    Weight weight = kernel_weight(own, samples.shares[kernel]);
    vec4 apart = is_sum() ? own : own - sum / weights, factor = vec4(weight.slope, weight.value) / weights;
    return factor.a * cotangent + vec4(factor.rgb * dot(cotangent, apart), 0.0);
}

// Those of a tap of a kernel of four, from the kernel's.
vec4 back_kernel(vec4 kernel, float weights, vec4 tap, vec4 cotangent)
{
    Weight weight = tap_weight(tap);
    vec4 by_weight = vec4(weight.slope * inner_product(cotangent, tap - kernel), 0.0);
    return (weight.value * cotangent + by_weight) / weights;
}
