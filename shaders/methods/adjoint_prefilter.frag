// The cotangents of what a pass with PREFILTER_BLOCK combines, of STACKED_SAMPLES from number FIRST_SAMPLE on: of its
// kernels; with BY_TAPS of its taps, which have point functions or weights of their own; of a mean, whose kernels all
// have a share of them, of the mean. Or the cotangents of the mask, or those of a threshold by what it reads, whose sums
// are the derivatives.

// Where the pass reads the image itself, as the threshold pass does.
#define TEXEL(value) (FROM_IMAGE != 0 ? finite_or_zero(value) : (value))
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/prefilter.glsl"

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#ifdef SUMS
#include "lib/values.glsl"
#else
#define STACKED STACKED_SAMPLES
#define STACKED_HEIGHT params.target_height
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"
#endif
#include "lib/mask.glsl"
#include "lib/target_cotangents.glsl"
#include "lib/prefilter_taps.glsl"

#ifdef SUMS

vec4 values()
{
    Place place = PLACE_IN(source);
    vec4 cotangent = mask_value() * cotangent_of_target();
    // What they would be multiplied by may be infinite.
    if (cotangent == vec4(0.0))
        return vec4(0.0);
    return by_point(POINT_AFTER, combined(samples_of(taps_at(place), place.part), kernel_count()), cotangent);
}

#else

vec4 taps[MAX_SET_TAPS], result, cotangent;
Samples samples;

// The cotangents of a tap, which is in one kernel or in several, from those of the combination.
#define ADD_KERNEL(number, share, a, b, c, d) \
    if (any(equal(ivec4(a, b, c, d), ivec4(tap)))) \
        total += back_kernel(samples.kernels[number], samples.weights[number], samples.taps[tap], \
                             back_combined(samples, kernel_count(), number, by_combined));
#define ADD_SET_KERNELS(name, value, ROWS, KERNELS, PLACE, SHARE) \
    if (TAP_SET == name) { \
        KERNELS(ADD_KERNEL) \
    }

vec4 back_tap(int tap, vec4 by_combined)
{
    vec4 total = vec4(0.0);
    TAP_SETS(ADD_SET_KERNELS)
    if (four_count() == 0)
        total = back_combined(samples, kernel_count(), tap, by_combined);
    total = back_point(POINT_BEFORE, taps[tap], total);
    return mix(vec4(0.0), total, has_finite_bits(total));
}

void start()
{
    Place place = PLACE_IN(source);
    taps = taps_at(place);
    samples = samples_of(taps, place.part);
    result = combined(samples, kernel_count());
    cotangent = cotangent_of_target();
}

vec4 shade()
{
    if (BY == BY_MASK)
        return gathered(vec4(inner_product(apply_point(POINT_AFTER, result), cotangent), 0.0, 0.0, 0.0));
    vec4 by_combined = back_point(POINT_AFTER, result, mask_value() * cotangent);
    // What they would be multiplied by may be infinite.
    if (is_mean() || by_combined == vec4(0.0))
        return gathered(by_combined);
    int number = FIRST_SAMPLE + picture;
    if (by_taps())
        return gathered(back_tap(number, by_combined));
    return gathered(back_combined(samples, kernel_count(), number, by_combined));
}

#endif
