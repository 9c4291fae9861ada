// The block of a filter, and how it changes the texels that it reads. With FINAL it makes the bloom, and is fused with
// the composite. Otherwise it may add the share of an image of the target's size, and with FROM_IMAGE it reads the image
// itself in place of the threshold pass's result.
#include "lib/sampling.glsl"

#ifdef FINAL
UNIFORM_BLOCK(FILTER_FINAL_BLOCK);
#include "lib/composite.glsl"

vec4 seen(vec4 value)
{
    return value;
}
#else
UNIFORM_BLOCK(FILTER_BLOCK);

vec4 seen(vec4 value)
{
    if (FROM_IMAGE == 0)
        return value;
    vec4 kept =
        apply_threshold(finite_or_zero(value), THRESHOLD_MODE, params.threshold, params.knee);
    // Without a knee the value is the texel or 0, which needs no rounding.
    return THRESHOLD_MODE == THRESHOLD_KNEE ? as_stored(kept, FORMAT) : kept;
}
#endif
#include "lib/filter.glsl"
