// The cotangents of the threshold pass, at its pixels: of the reduced image, of the mask, or of
// threshold, knee, and a factor of all light, whose sums are their derivatives.

#define TEXEL(value) finite_or_zero(value)
#include "lib/sampling.glsl"

UNIFORM_BLOCK(THRESHOLD_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, image);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#ifdef SUMS
#include "lib/values.glsl"
#else
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"
#endif
#include "lib/mask.glsl"
#include "lib/target_cotangents.glsl"

vec4 reduced()
{
    Place place = PLACE_IN(image);
    bool within = THRESHOLD_MODE == THRESHOLD_HARD && SAMPLING == SAMPLING_FETCH;
    return within ? fetch_within(image, place) : sample_at(image, place, vec2(0.0), SAMPLING);
}

#ifdef SUMS

vec4 values()
{
    vec4 colour = reduced();
    Soft soft = knee_of(colour.rgb, params.threshold, params.knee);
    vec3 values = vec3(by_threshold_and_knee(soft, params.threshold, params.knee), soft.factor);
    return vec4(values * (inner_product(cotangent_of_target(), colour) * mask_value()), 0.0);
}

#else

vec4 shade()
{
    vec4 colour = reduced(), cotangent = cotangent_of_target();
    if (BY == BY_MASK) {
        vec4 kept = apply_threshold(colour, THRESHOLD_MODE, params.threshold, params.knee);
        return gathered(vec4(inner_product(kept, cotangent), 0.0, 0.0, 0.0));
    }
    return gathered(back_through_threshold(colour, mask_value() * cotangent, THRESHOLD_MODE,
                                           params.threshold, params.knee));
}

#endif
