// The cotangents of what Godot's blurs of the frame weight by brightness: before the horizontal one the
// samples, after the vertical one the sum; or those of the mask.
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/sampling.glsl"
#include "lib/threshold_slope.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 3) uniform sampler2D cotangents;

#define TARGET_BINDING 6
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"
#include "lib/godot.glsl"
#include "lib/adjoint.glsl"

// Through value / (1 + L) or, with a sign of -1, value / (1 - L).
vec4 back_weighted(vec4 value, vec4 cotangent, float sign)
{
    float divisor = 1.0 + sign * luminance(value);
    float slope = larger(vec4(dot(value.rgb, GODOT_LUMINANCE)), vec4(0.0)).x * sign
                / max(params.luminance_cap, 6.0);
    float by_divisor = -dot(cotangent, value) / (divisor * divisor);
    return cotangent / divisor + vec4(slope * by_divisor * GODOT_LUMINANCE, 0.0);
}

vec4 back_glowing(vec4 sum, vec4 cotangent)
{
    vec4 value = exposed(sum);
    float kept = THRESHOLDED != 0 ? feedback(value) : 1.0, t = transition(value);
    cotangent.rgb *= larger(vec4(params.luminance_cap), kept * value).rgb;
    float slope = THRESHOLDED != 0
                    ? larger(vec4(t * t * (3.0 - 2.0 * t)), vec4(params.glow_bloom)).x * 6.0 * t
                          * (1.0 - t) / max(params.threshold_scale, 1e-6)
                    : 0.0;
    cotangent = kept * cotangent
            + vec4(shares_of_brightest(value.rgb), 0.0) * (slope * dot(cotangent, value));
    cotangent.rgb *= exp2(params.exposure);
    return back_weighted(sum, params.strength * cotangent, -1.0);
}

vec4 blurred_column(int height)
{
    vec4 sum = vec4(0.0);
    for (int tap = -4; tap <= 4; ++tap)
        sum += GODOT_WEIGHTS[abs(tap)]
             * texelFetch(source, ivec2(PIXEL.x, paired(PIXEL.y + tap, height)), 0);
    return sum;
}

vec4 shade()
{
    vec4 cotangent = texelFetch(cotangents, PIXEL, 0);
    if (ALPHA != ALPHA_BLUR)
        cotangent.a = 0.0;
    if (DIRECTION == DIRECTION_HORIZONTAL) {
        vec4 value = sample_at(source, PLACE_IN(source), vec2(0.0), SAMPLING);
        return gathered(back_weighted(value, cotangent, 1.0));
    }
    vec4 sum = blurred_column(params.target_height);
    if (BY == BY_MASK)
        return gathered(vec4(dot(glowing(sum), cotangent), 0.0, 0.0, 0.0));
    return gathered(back_glowing(sum, mask_value() * cotangent));
}
