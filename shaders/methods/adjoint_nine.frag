// The cotangents of what Godot's blurs of the frame weight by brightness: before the horizontal one the samples, after
// the vertical one the sum; or those of the mask, or of the threshold by what it reads, whose sums are the derivatives.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#ifdef SUMS
#include "lib/values.glsl"
#else
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"
#endif
#include "lib/mask.glsl"
#include "lib/target_cotangents.glsl"
#include "lib/nine.glsl"
#include "lib/nine_taps.glsl"

#ifdef SUMS

vec4 values()
{
    vec4 cotangent = mask_value() * cotangent_of_target();
    // What they would be multiplied by may be infinite.
    return cotangent == vec4(0.0) ? vec4(0.0) : by_point(POINT_AFTER, nine_sum(), cotangent);
}

#else

vec4 shade()
{
    vec4 cotangent = cotangent_of_target();
    if (DIRECTION == DIRECTION_HORIZONTAL)
        return gathered(back_point(POINT_BEFORE, sample_at(source, PLACE_IN(source), vec2(0.0), SAMPLING), cotangent));
    vec4 sum = nine_sum();
    if (BY == BY_MASK)
        return gathered(vec4(inner_product(apply_point(POINT_AFTER, sum), cotangent), 0.0, 0.0, 0.0));
    return gathered(back_point(POINT_AFTER, sum, mask_value() * cotangent));
}

#endif
