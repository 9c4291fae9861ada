// The cotangents of the threshold pass, at its pixels: of the reduced image, of the mask, or of
// threshold and knee, whose sums are their derivatives.

#define TEXEL(value) finite_or_zero(value)
#include "lib/sampling.glsl"

UNIFORM_BLOCK(THRESHOLD_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, image);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"
#include "lib/mask.glsl"

vec4 reduced()
{
    Place place = PLACE_IN(image);
    bool within = THRESHOLD_MODE == THRESHOLD_HARD && SAMPLING == SAMPLING_FETCH;
    return within ? fetch_within(image, place) : sample_at(image, place, vec2(0.0), SAMPLING);
}

vec4 shade()
{
    vec4 colour = reduced(), cotangent = texelFetch(cotangents, PIXEL, 0);
    if (ALPHA != ALPHA_BLUR)
        cotangent.a = 0.0;
    if (BY == BY_VALUES) {
        float width = params.threshold * params.knee;
        Soft soft = soft_threshold(largest(colour.rgb), params.threshold, width, 4.0 * width + 1e-5, 1e-5);
        vec2 values = vec2(soft.by_threshold + params.knee * soft.by_width, params.threshold * soft.by_width);
        return vec4(values * inner_product(cotangent, colour) * mask_value(), 0.0, 0.0);
    }
    if (BY == BY_MASK) {
        vec4 kept = apply_threshold(colour, THRESHOLD_MODE, params.threshold, params.knee);
        return gathered(vec4(inner_product(kept, cotangent), 0.0, 0.0, 0.0));
    }
    return gathered(back_through_threshold(colour, mask_value() * cotangent, THRESHOLD_MODE,
                                           params.threshold, params.knee));
}
