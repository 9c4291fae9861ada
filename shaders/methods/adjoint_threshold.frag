// The cotangents of the threshold pass, at its pixels: of the reduced image, of the mask, or of
// threshold and knee, whose sums are their derivatives.
#include "lib/threshold.glsl"
#include "lib/threshold_slope.glsl"

#define TEXEL(value) finite_or_zero(value)
#include "lib/sampling.glsl"

UNIFORM_BLOCK(THRESHOLD_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D image;
layout(set = 0, binding = 3) uniform sampler2D cotangents;

#define TARGET_BINDING 6
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"
#include "lib/mask.glsl"

vec4 reduced()
{
    Place place = PLACE_IN(image);
    bool within = THRESHOLD_MODE == THRESHOLD_HARD && SAMPLING == SAMPLING_FETCH;
    return within ? fetch_within(image, place) : sample_at(image, place, vec2(0.0), SAMPLING);
}

// The derivatives of the soft threshold's factor by threshold and knee.
vec2 soft_values(float brightness)
{
    float width = params.threshold * params.knee, divisor = 4.0 * width + 1e-5;
    float above = brightness - params.threshold, moved = above + width;
    float soft = clamp(moved, 0.0, 2.0 * width), square = soft * soft / divisor;
    vec2 by_width = vec2(params.knee, params.threshold), by_moved = by_width - vec2(1.0, 0.0);
    vec2 by_soft = moved < 0.0 ? vec2(0.0) : moved > 2.0 * width ? 2.0 * by_width : by_moved;
    vec2 by_square = (2.0 * soft * by_soft - square * 4.0 * by_width) / divisor;
    vec2 by_line = vec2(-1.0, 0.0);
    vec2 by_top = square > above   ? by_square
                : square < above ? by_line
                                 : 0.5 * (by_square + by_line);
    return by_top / max(brightness, 1e-5);
}

vec4 shade()
{
    vec4 colour = reduced(), cotangent = texelFetch(cotangents, PIXEL, 0);
    if (ALPHA != ALPHA_BLUR)
        cotangent.a = 0.0;
    if (BY == BY_VALUES) {
        float whole = dot(cotangent, colour) * mask_value();
        return vec4(soft_values(max(colour.r, max(colour.g, colour.b))) * whole, 0.0, 0.0);
    }
    if (BY == BY_MASK) {
        vec4 kept = apply_threshold(colour, THRESHOLD_MODE, params.threshold, params.knee);
        return gathered(vec4(dot(kept, cotangent), 0.0, 0.0, 0.0));
    }
    return gathered(back_through_threshold(colour, mask_value() * cotangent, THRESHOLD_MODE,
                                           params.threshold, params.knee));
}
