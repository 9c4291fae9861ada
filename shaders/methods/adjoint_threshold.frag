#version 450
#extension GL_GOOGLE_include_directive : require
// The cotangents of the threshold pass, at its pixels: of the reduced image, of the mask, or of
// threshold and knee, whose sums are their derivatives.
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/threshold.glsl"
#include "lib/threshold_slope.glsl"

#define TEXEL(value) finite_or_zero(value)
#include "lib/sampling.glsl"

UNIFORM_BLOCK(THRESHOLD_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D image;
layout(set = 0, binding = 2) uniform sampler2D mask;
layout(set = 0, binding = 3) uniform sampler2D cotangents;

#define TARGET_BINDING 6
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"
#include "lib/sums.glsl"

#define PLACE_OF(source, pixel) \
    place_in(source, pixel, ivec2(params.target_width, params.target_height))

vec4 reduced(ivec2 pixel)
{
    Place place = PLACE_OF(image, pixel);
    bool within = THRESHOLD_MODE == THRESHOLD_HARD && SAMPLING == SAMPLING_FETCH;
    return within ? fetch_within(image, place) : sample_at(image, place, vec2(0.0), SAMPLING);
}

float mask_at(ivec2 pixel)
{
    return MASKED == 0 ? 1.0 : sample_at(mask, PLACE_OF(mask, pixel), vec2(0.0), SAMPLING).r;
}

vec4 cotangent_at(ivec2 pixel)
{
    vec4 value = texelFetch(cotangents, pixel, 0);
    return ALPHA == ALPHA_BLUR ? value : vec4(value.rgb, 0.0);
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

vec4 by_values(ivec2 pixel)
{
    vec4 colour = reduced(pixel);
    float brightness = max(colour.r, max(colour.g, colour.b));
    float whole = dot(cotangent_at(pixel), colour) * mask_at(pixel);
    return vec4(soft_values(brightness) * whole, 0.0, 0.0);
}

SUM_OF_BLOCK(by_values)

vec4 shade()
{
    if (BY >= BY_VALUES)
        return sum_of_block(ivec2(params.target_width, params.target_height));
    vec4 colour = reduced(PIXEL), cotangent = cotangent_at(PIXEL);
    if (BY == BY_MASK) {
        vec4 kept = apply_threshold(colour, THRESHOLD_MODE, params.threshold, params.knee);
        return gathered(vec4(dot(kept, cotangent), 0.0, 0.0, 0.0));
    }
    return gathered(back_through_threshold(colour, mask_at(PIXEL) * cotangent, THRESHOLD_MODE,
                                           params.threshold, params.knee));
}
