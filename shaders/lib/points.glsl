// Functions of a value before and after it is combined with others (POINTS of params.h), each with its slope: `back_`
// takes cotangents of the result to those of the value. With SUMS, `by_` takes them to those of what a threshold reads,
// in the order of `_threshold_fields` of the method's settings. For shaders with PREFILTER_BLOCK.
#include "lib/lab.glsl"

// An upper bound of colours.
vec4 capped(vec4 value)
{
    return vec4(min(value.rgb, vec3(params.clamp_max)), value.a);
}

vec4 back_capped(vec4 value, vec4 cotangent)
{
    return vec4(cotangent.rgb * larger(vec4(params.clamp_max), value).rgb, cotangent.a);
}

// With CLAMPED, what is below 0 is 0.
vec4 clamped(vec4 value)
{
    return CLAMPED != 0 ? max(value, vec4(0.0)) : value;
}

vec4 back_clamped(vec4 value, vec4 cotangent)
{
    return CLAMPED != 0 ? cotangent * larger(value, vec4(0.0)) : cotangent;
}

bvec4 has_finite_bits(vec4 value)
{
    return notEqual(floatBitsToUint(value) & 0x7f800000u, uvec4(0x7f800000u));
}

// What is not finite is 0. (Also where the source is known to be finite: a quotient need not be.)
vec4 finite(vec4 value)
{
    return clamped(mix(vec4(0.0), value, has_finite_bits(value)));
}

vec4 back_finite(vec4 value, vec4 cotangent)
{
    return mix(vec4(0.0), back_clamped(value, cotangent), has_finite_bits(value));
}

vec4 tinted(vec4 value)
{
    return params.tint[0] * value;
}

vec4 back_tinted(vec4 value, vec4 cotangent)
{
    return params.tint[0] * cotangent;
}

// Filament's threshold subtracts, and the rest is rolled off (google/filament, bloomDownsample2x.mat
// @ 9f62dc2f2f53).
vec4 rolled(vec4 value)
{
    value = part_above(value, params.threshold);
    return value / (1.0 + largest(value.rgb) / params.highlight);
}

vec4 back_rolled(vec4 value, vec4 cotangent)
{
    vec4 above = part_above(value, params.threshold);
    float divisor = 1.0 + largest(above.rgb) / params.highlight;
    // The product with the result, not with what is above, which may overflow.
    vec3 slope = shares_of_brightest(above.rgb) / (-params.highlight * divisor);
    vec4 factor = vec4(slope, 1.0 / divisor);
    return back_part_above(value, back_through_factor(above / divisor, factor, cotangent), params.threshold);
}

#ifdef SUMS
vec4 by_rolled(vec4 value, vec4 cotangent)
{
    vec4 above = part_above(value, params.threshold);
    float most = largest(above.rgb), brightest = largest(value.rgb), divisor = 1.0 + most / params.highlight;
    float slope = -1.0 / (params.highlight * divisor), by_divisor = inner_product(above / divisor, cotangent);
    vec4 by_above = vec4(cotangent.rgb / divisor + slope * by_divisor * shares_of_brightest(above.rgb),
                         cotangent.a / divisor);
    // Alpha is multiplied by the share of the brightest channel that is above.
    float by_threshold = -dot(by_above.rgb, larger(value, vec4(params.threshold)).rgb)
                       - by_above.a * value.a * larger(brightest, params.threshold) / max(brightest, 1e-30);
    return vec4(by_threshold, -slope * by_divisor * most / params.highlight, 0.0, 0.0);
}
#endif

// The highlights of Blender's Glare node (formulas of the compositor of Blender 4.5).

// The value that a smooth transition of this width subtracts (minimum) or adds (maximum) at a
// distance from it (Quilez, "Smooth minimum").
float rounding(float distance_to_end, float width)
{
    float h = width > 0.0 ? max(1.0 - abs(distance_to_end) / width, 0.0) : 0.0;
    return 0.25 * h * h * width;
}

float rounding_slope(float distance_to_end, float width)
{
    float h = width > 0.0 ? max(1.0 - abs(distance_to_end) / width, 0.0) : 0.0;
    return -0.5 * h * sign(distance_to_end);
}

// The brightness above the threshold, and its derivative.
vec2 highlight(float value)
{
    float low = params.threshold, range = params.maximum, high = low + range;
    // The widths are limited, so that the transitions stay between 0 and the other end.
    float at_low = min(params.smoothness, min(low, range));
    float at_high = min(params.smoothness, min(high, range));
    float above = value - low;
    float kept = max(above, 0.0) + rounding(above, at_low);
    float slope = larger(range, kept) - rounding_slope(kept - range, at_high);
    return vec2(min(kept, range) - rounding(kept - range, at_high),
                slope * (larger(above, 0.0) + rounding_slope(above, at_low)));
}

vec4 highlights(vec4 value)
{
    if (THRESHOLDED == 0)
        return value;
    float brightest = largest(value.rgb);
    return brightest > 0.0 ? value * (highlight(brightest).x / brightest) : vec4(0.0);
}

vec4 back_highlights(vec4 value, vec4 cotangent)
{
    float brightest = largest(value.rgb);
    if (THRESHOLDED == 0)
        return cotangent;
    if (brightest <= 0.0)
        return vec4(0.0);
    vec2 kept = highlight(brightest);
    float factor = kept.x / brightest;
    // Divided first: products of small numbers are 0.
    float slope = (kept.y - factor) * inner_product(cotangent, value / brightest);
    return factor * cotangent + vec4(slope * shares_of_brightest(value.rgb), 0.0);
}

#ifdef SUMS
// The derivative of the value that a transition subtracts or adds, by its width.
float rounding_by_width(float distance_to_end, float width)
{
    float h = width > 0.0 ? max(1.0 - abs(distance_to_end) / width, 0.0) : 0.0;
    return 0.5 * h - 0.25 * h * h;
}

vec4 by_highlights(vec4 value, vec4 cotangent)
{
    float brightest = largest(value.rgb), low = params.threshold, range = params.maximum;
    if (brightest <= 0.0)
        return vec4(0.0);
    float width = min(params.smoothness, range), at_low = min(width, low), above = brightest - low;
    float kept = max(above, 0.0) + rounding(above, at_low);
    float slope = larger(range, kept) - rounding_slope(kept - range, width);
    float by_low = rounding_by_width(above, at_low), width_by_smoothness = larger(range, params.smoothness);
    float by_threshold = by_low * larger(width, low) - larger(above, 0.0) - rounding_slope(above, at_low);
    float by_width = slope * by_low * larger(low, width) - rounding_by_width(kept - range, width);
    return inner_product(cotangent, value / brightest)
         * vec4(slope * by_threshold, by_width * width_by_smoothness, 0.0, 0.0);
}
#endif

// darktable's: a step of the lightness (darktable 4.2.1, src/iop/bloom.c).
vec4 bright_lightness(vec4 value)
{
    float light = params.strength * lightness_of(value.rgb);
    bool bright = THRESHOLDED == 0 || light > params.threshold;
    return bright ? vec4(vec3(light / 100.0), value.a) : vec4(0.0);
}

vec4 back_bright_lightness(vec4 value, vec4 cotangent)
{
    float light = params.strength * lightness_of(value.rgb);
    bool bright = THRESHOLDED == 0 || light > params.threshold;
    float by_light = (cotangent.r + cotangent.g + cotangent.b) * params.strength * 1.16;
    return bright ? vec4(by_light * lab_slope(value.rgb).y * WHITE_SHARES[1], cotangent.a) : vec4(0.0);
}

// Thresholds that multiply a colour by a factor, which is not negative, and then tint it.
vec4 through_factor(vec4 value, vec4 factor)
{
    if (THRESHOLDED != 0)
        value *= factor.a;
    return tinted(clamped(value));
}

vec4 back_through_factor_and_tint(vec4 value, vec4 factor, vec4 cotangent)
{
    cotangent = back_clamped(value, back_tinted(value, cotangent));
    return THRESHOLDED != 0 ? back_through_factor(value, factor, cotangent) : cotangent;
}

// The point function of a factor, which is in alpha behind its derivatives by the channels.
#define BY_FACTOR(name) \
    vec4 name(vec4 value) \
    { \
        return through_factor(value, name##_factor(value.rgb)); \
    } \
    vec4 back_##name(vec4 value, vec4 cotangent) \
    { \
        return back_through_factor_and_tint(value, name##_factor(value.rgb), cotangent); \
    }

// The point function of a threshold, with the derivatives of its factor by what it reads.
#ifdef SUMS
#define THRESHOLD_OF_FACTOR(name) \
    BY_FACTOR(name) \
    vec4 by_##name(vec4 value, vec4 cotangent) \
    { \
        float by_factor = inner_product(back_clamped(value, back_tinted(value, cotangent)), value); \
        return vec4(by_factor * name##_slopes(value.rgb), 0.0, 0.0); \
    }
#else
#define THRESHOLD_OF_FACTOR(name) BY_FACTOR(name)
#endif

// The point function of a threshold that is a quadratic knee.
#define THRESHOLD_OF_KNEE(name) \
    vec4 name##_factor(vec3 colour) \
    { \
        return soft_factor(name##_knee(largest(colour)), colour); \
    } \
    vec2 name##_slopes(vec3 colour) \
    { \
        return by_threshold_and_knee(name##_knee(largest(colour)), params.threshold, params.knee); \
    } \
    THRESHOLD_OF_FACTOR(name)

// Sources differ in what keeps a width of 0 and black from a division by 0.
Soft knee_with(float brightness, float wider, float divisor, float least)
{
    return soft_threshold(brightness, params.threshold, params.threshold * params.knee + wider, divisor, least);
}

Soft kino_knee(float brightness)
{
    return knee_with(brightness, 1e-5, 4.0 * (params.threshold * params.knee + 1e-5), 1e-5);
}
THRESHOLD_OF_KNEE(kino)

// Unity-Technologies/PostProcessing @ 32c3155207d3, Bloom.shader.
Soft ppv2_knee(float brightness)
{
    return knee_with(brightness, 1e-5, 4.0 * (params.threshold * params.knee + 1e-5), 1e-4);
}
THRESHOLD_OF_KNEE(ppv2)

// Unity-Technologies/Graphics, com.unity.render-pipelines.universal, Bloom.shader @ 00d472fae509.
Soft urp_knee(float brightness)
{
    return knee_with(brightness, 0.0, 4.0 * (params.threshold * params.knee) + 1e-4, 1e-4);
}
THRESHOLD_OF_KNEE(urp)

// A step at the luminance threshold^(1 / 2.2) (BabylonJS/Babylon.js, extractHighlights.fragment.fx @ bc81a5f32960).
vec4 babylon_factor(vec3 colour)
{
    return vec4(vec3(0.0), float(dot(colour, LUMINANCE) >= pow(params.threshold, 1.0 / 2.2)));
}
BY_FACTOR(babylon)

// A smooth step of a share, 0 to 1.
float smooth_share(float share)
{
    return share * share * (3.0 - 2.0 * share);
}

// three.js' high pass: a smooth step of the luminance (mrdoob/three.js,
// examples/jsm/shaders/LuminosityHighPassShader.js @ 0255e15dd1d4).
float smooth_place(float luminance)
{
    return (luminance - params.threshold) / params.smooth_width;
}

float smooth_slope(float place)
{
    float t = clamp(place, 0.0, 1.0);
    return t == place ? 6.0 * t * (1.0 - t) / params.smooth_width : 0.0;
}

vec4 smooth_step_factor(vec3 colour, vec3 weights)
{
    float place = smooth_place(dot(colour, weights)), t = clamp(place, 0.0, 1.0);
    // Not smoothstep(), which is undefined where rounding makes both ends equal.
    return vec4(smooth_slope(place) * weights, smooth_share(t));
}

// By the threshold and the width.
vec2 smooth_step_slopes(float luminance)
{
    float place = smooth_place(luminance);
    return -smooth_slope(place) * vec2(1.0, place);
}

const vec3 THREE_LUMINANCE = vec3(0.2126729, 0.7151522, 0.0721750);

vec4 three_factor(vec3 colour)
{
    return smooth_step_factor(colour, THREE_LUMINANCE);
}

vec2 three_slopes(vec3 colour)
{
    return smooth_step_slopes(dot(colour, THREE_LUMINANCE));
}
THRESHOLD_OF_FACTOR(three)

// BloomNode's luminance is that of three.js' colour management.
vec4 three_node_factor(vec3 colour)
{
    return smooth_step_factor(colour, LUMINANCE);
}

vec2 three_node_slopes(vec3 colour)
{
    return smooth_step_slopes(dot(colour, LUMINANCE));
}
THRESHOLD_OF_FACTOR(three_node)

// Unreal's: the luminance above the threshold, of which 1 more is stored (Epic Games, "Bloom").
vec2 unreal_share(vec3 colour)
{
    float share = dot(colour, LUMINANCE) + 1.0 - params.threshold;
    return vec2(share, larger(share, 0.0) * larger(1.0, share));
}

vec4 unreal_factor(vec3 colour)
{
    vec2 share = unreal_share(colour);
    return vec4(share.y * LUMINANCE, clamp(share.x, 0.0, 1.0));
}

vec2 unreal_slopes(vec3 colour)
{
    return vec2(-unreal_share(colour).y, 0.0);
}
THRESHOLD_OF_FACTOR(unreal)

// Bevy's colours have a floor before the threshold (bevyengine/bevy v0.19.1, bloom.wgsl).
const float BEVY_FLOOR = 1e-4;

Soft held_knee(float brightness)
{
    return knee_with(brightness, 0.0, 4.0 * (params.threshold * params.knee + 1e-5), 1e-5);
}
THRESHOLD_OF_KNEE(held)

vec4 bevy(vec4 value)
{
    return held(vec4(max(value.rgb, vec3(BEVY_FLOOR)), value.a));
}

vec4 back_bevy(vec4 value, vec4 cotangent)
{
    cotangent = back_held(vec4(max(value.rgb, vec3(BEVY_FLOOR)), value.a), cotangent);
    return vec4(cotangent.rgb * larger(value, vec4(BEVY_FLOOR)).rgb, cotangent.a);
}

#ifdef SUMS
vec4 by_bevy(vec4 value, vec4 cotangent)
{
    return by_held(vec4(max(value.rgb, vec3(BEVY_FLOOR)), value.a), cotangent);
}
#endif

// Godot's (godotengine/godot, copy.glsl @ 0a5efd02df51): brighter samples of the frame weigh less, against fireflies,
// and the blurred frame is divided by what is left.
const vec3 GODOT_LUMINANCE = vec3(0.299, 0.587, 0.114);

// In units of the cap, which is at least 6. Negative luminances count as 0.
float luminance(vec4 value)
{
    return max(dot(value.rgb, GODOT_LUMINANCE), 0.0) / max(params.luminance_cap, 6.0);
}

// Through value / (1 + L), or with a sign of -1 through value / (1 - L), for the luminance L.
vec4 back_divided(vec4 value, vec4 cotangent, float sign)
{
    float divisor = 1.0 + sign * luminance(value), grey = dot(value.rgb, GODOT_LUMINANCE);
    float slope = sign * larger(grey, 0.0) / max(params.luminance_cap, 6.0);
    float by_divisor = -inner_product(cotangent, value) / divisor / divisor;
    return cotangent / divisor + vec4(slope * by_divisor * GODOT_LUMINANCE, 0.0);
}

vec4 dimmed(vec4 value)
{
    return value / (1.0 + luminance(value));
}

vec4 back_dimmed(vec4 value, vec4 cotangent)
{
    return back_divided(value, cotangent, 1.0);
}

// The blurred frame after strength and exposure. Neither exposure nor the cap applies to alpha.
vec4 exposed(vec4 sum)
{
    vec4 value = sum / (1.0 - luminance(sum)) * params.strength;
    value.rgb *= exp2(params.exposure);
    return value;
}

// How far a colour is from the threshold to the full glow, 0 to 1. A scale of 0 means a step.
float glow_scale()
{
    return max(params.threshold_scale, 1e-6);
}

float glow_place(vec3 colour)
{
    return clamp((largest(colour) - params.threshold) / glow_scale(), 0.0, 1.0);
}

// The slope of the factor by the brightest channel.
float glow_slope(float place)
{
    return larger(smooth_share(place), params.glow_bloom) * 6.0 * place * (1.0 - place) / glow_scale();
}

// The factor of what is above the threshold, in alpha, and its derivatives by the channels.
vec4 glow_factor(vec3 colour)
{
    float place = glow_place(colour);
    return vec4(glow_slope(place) * shares_of_brightest(colour), max(smooth_share(place), params.glow_bloom));
}

// What glows of it.
vec4 glowing(vec4 sum)
{
    vec4 value = exposed(sum);
    if (THRESHOLDED != 0)
        value *= glow_factor(value.rgb).a;
    return vec4(min(value.rgb, vec3(params.luminance_cap)), value.a);
}

vec4 back_glowing(vec4 sum, vec4 cotangent)
{
    vec4 value = exposed(sum), factor = THRESHOLDED != 0 ? glow_factor(value.rgb) : vec4(0.0, 0.0, 0.0, 1.0);
    cotangent.rgb *= larger(vec4(params.luminance_cap), factor.a * value).rgb;
    cotangent = back_through_factor(value, factor, cotangent);
    cotangent.rgb *= exp2(params.exposure);
    return back_divided(sum, params.strength * cotangent, -1.0);
}

#ifdef SUMS
vec4 by_glowing(vec4 sum, vec4 cotangent)
{
    vec4 value = exposed(sum);
    cotangent.rgb *= larger(vec4(params.luminance_cap), glow_factor(value.rgb).a * value).rgb;
    float place = glow_place(value.rgb), slope = glow_slope(place);
    float by_scale = -slope * place * larger(params.threshold_scale, 1e-6);
    return inner_product(cotangent, value)
         * vec4(-slope, by_scale, larger(params.glow_bloom, smooth_share(place)), 0.0);
}
#endif

#define CALL_POINT(name, number, function) \
    if (point == name) \
        return function(value);
#define CALL_SLOPE(name, number, function) \
    if (point == name) \
        return back_##function(value, cotangent);

vec4 apply_point(int point, vec4 value)
{
    POINTS(CALL_POINT)
    return value;
}

vec4 back_point(int point, vec4 value, vec4 cotangent)
{
    POINTS(CALL_SLOPE)
    return cotangent;
}

#ifdef SUMS
#define CALL_THRESHOLD(name, number, function) \
    if (point == name) \
        return by_##function(value, cotangent);

vec4 by_point(int point, vec4 value, vec4 cotangent)
{
    THRESHOLD_POINTS(CALL_THRESHOLD)
    return vec4(0.0);
}
#endif
