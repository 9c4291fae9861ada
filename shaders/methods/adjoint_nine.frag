// The cotangents of what Godot's blurs of the frame weight by brightness: before the horizontal one the samples, after
// the vertical one the sum; or those of the mask.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"
#include "lib/nine.glsl"
#include "lib/nine_taps.glsl"
#include "lib/adjoint.glsl"

vec4 shade()
{
    vec4 cotangent = texelFetch(cotangents, PIXEL, 0);
    if (ALPHA != ALPHA_BLUR)
        cotangent.a = 0.0;
    if (DIRECTION == DIRECTION_HORIZONTAL)
        return gathered(back_point(POINT_BEFORE, sample_at(source, PLACE_IN(source), vec2(0.0), SAMPLING), cotangent));
    vec4 sum = nine_sum();
    if (BY == BY_MASK)
        return gathered(vec4(inner_product(apply_point(POINT_AFTER, sum), cotangent), 0.0, 0.0, 0.0));
    return gathered(back_point(POINT_AFTER, sum, mask_value() * cotangent));
}
