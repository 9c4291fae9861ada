// The cotangents of the threshold pass, at its pixels: of the reduced image, of the mask, or of
// threshold, knee, and a factor of all light, whose sums are their derivatives.

#define TEXEL(value) finite_or_zero(value)
#include "lib/sampling.glsl"

UNIFORM_BLOCK(THRESHOLD_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, image);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#ifdef SUMS
#include "lib/sums.glsl"
#else
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"
#endif
#include "lib/mask.glsl"

vec4 reduced()
{
    Place place = PLACE_IN(image);
    bool within = THRESHOLD_MODE == THRESHOLD_HARD && SAMPLING == SAMPLING_FETCH;
    return within ? fetch_within(image, place) : sample_at(image, place, vec2(0.0), SAMPLING);
}

vec4 cotangent_of_target()
{
    vec4 cotangent = texelFetch(cotangents, PIXEL, 0);
    return ALPHA == ALPHA_BLUR ? cotangent : vec4(cotangent.rgb, 0.0);
}

#ifdef SUMS

ivec2 summed_size()
{
    return ivec2(params.target_width, params.target_height);
}

void add_pixel(inout vec4 sum, inout vec4 squares)
{
    vec4 colour = reduced();
    float width = params.threshold * params.knee;
    Soft soft = soft_threshold(largest(colour.rgb), params.threshold, width, 4.0 * width + 1e-5, 1e-5);
    vec3 values = vec3(soft.by_threshold + params.knee * soft.by_width, params.threshold * soft.by_width, soft.factor);
    values *= inner_product(cotangent_of_target(), colour) * mask_value();
    sum.rgb += values;
    squares.rgb += values * values;
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
