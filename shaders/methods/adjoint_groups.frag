// The cotangents of the groups of taps from which a downsampling makes a pixel, where it is not linear
// in these: of RADIX_1 groups from number LEVELS on, or of the mask.
#include "lib/sampling.glsl"
#include "lib/threshold.glsl"
#include "lib/threshold_slope.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/prefilters.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 3) uniform sampler2D cotangents;

#define TARGET_BINDING 6
#define STACKED RADIX_1
#define STACKED_HEIGHT params.target_height
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"
#include "lib/adjoint.glsl"
#include "lib/prefilter_taps.glsl"

// The group whose cotangents are wanted, what the groups are, and the cotangents of the pixel.
int own_group;
Place place;
vec4 found[5], cotangent;

// A group's weight by brightness, and its derivative by the colour.
float weight_of(vec4 mean, float share, out vec3 slope)
{
    bool brightest = GROUPS == GROUPS_BOX || GROUPS == GROUPS_FILAMENT;
    vec3 coefficients = brightest ? shares_of_brightest(mean.rgb) : LUMINANCE;
    float brightness = brightest ? max(mean.r, max(mean.g, mean.b)) : dot(mean.rgb, coefficients);
    // pygfx' luminances may be negative.
    float counts =
        GROUPS == GROUPS_PYGFX_KARIS ? 1.0 : larger(vec4(brightness), vec4(0.0)).x;
    float divisor = 1.0 + (counts > 0.0 ? brightness : 0.0);
    slope = -counts * share / (divisor * divisor) * coefficients;
    return share / divisor;
}

// The mean of Filament's taps, above the threshold.
vec4 back_filament(vec4 mean, vec4 cotangent)
{
    vec3 above = max(mean.rgb - params.threshold, vec3(0.0));
    float brightness = brightest(above), divisor = 1.0 + brightness / params.highlight;
    float value = max(mean.r, max(mean.g, mean.b));
    float factor = value > 0.0 ? brightness / (divisor * value) : 0.0;
    float by_factor = cotangent.a * mean.a;
    float by_brightness = -dot(cotangent.rgb, above) / params.highlight
                        + (value > 0.0 ? by_factor / value : 0.0);
    vec3 by_above = cotangent.rgb / divisor
                  + shares_of_brightest(mean.rgb) * (by_brightness / (divisor * divisor));
    vec3 by_value = shares_of_brightest(mean.rgb) * (value > 0.0 ? -by_factor * factor / value : 0.0);
    return vec4(by_above * larger(mean, vec4(params.threshold)).rgb + by_value, cotangent.a * factor);
}

// The weighted mean, and what a method makes of it.
vec4 back_end(vec4 mean, vec4 cotangent)
{
    if (GROUPS == GROUPS_FILAMENT)
        return back_filament(mean, cotangent);
    if (GROUPS == GROUPS_PYGFX_KARIS)
        return cotangent * larger(usual(mean), vec4(0.0));
    return cotangent;
}

vec4 back_weighted(vec4 found[5], vec4 cotangent, Place place)
{
    vec3 slope, own_slope = vec3(0.0);
    vec4 sum = vec4(0.0), own = vec4(0.0), shares = filament_taps(place.part).shares;
    float total = 0.0, own_weight = 0.0;
    // Not in the loop's condition: lavapipe 22.3.6 ends a loop early whose condition has branches by
    // specialization constants.
    int count = group_count();
    for (int group = 0; group < count; ++group) {
        float weight = weight_of(found[group], share_of(group, shares), slope);
        sum += weight * found[group];
        total += weight;
        if (group == own_group) {
            own = found[group];
            own_weight = weight;
            own_slope = slope;
        }
    }
    vec4 mean = sum / total, by_mean = back_end(mean, cotangent);
    if (by_mean == vec4(0.0))
        return by_mean;
    return (own_weight * by_mean + vec4(own_slope, 0.0) * dot(by_mean, own - mean)) / total;
}

vec4 back_bevy(vec4 found[5], vec4 cotangent)
{
    vec4 sum = vec4(0.0), own = vec4(0.0);
    float own_share = 0.0;
    for (int group = 0; group < 5; ++group) {
        vec4 part = GROUP_SHARES[group] * found[group];
        sum += part / (1.0 + 0.25 * group_luminance(part));
        if (group == own_group) {
            own = part;
            own_share = GROUP_SHARES[group];
        }
    }
    if (THRESHOLDED != 0) {
        float width = params.threshold * params.knee;
        cotangent = back_through_soft(vec4(max(sum.rgb, vec3(1e-4)), sum.a), cotangent, params.threshold,
                                    width, 4.0 * (width + 1e-5), 1e-5);
    }
    cotangent.rgb *= larger(sum, vec4(1e-4)).rgb;
    float divisor = 1.0 + 0.25 * group_luminance(own);
    float slope = larger(vec4(dot(own.rgb, LUMINANCE)), vec4(0.0)).x * 0.25 * dot(cotangent, own)
                / (divisor * divisor);
    return own_share * (cotangent / divisor - vec4(slope * LUMINANCE, 0.0));
}

vec4 back_unity(vec4 value, vec4 cotangent)
{
    vec4 kept = vec4(min(value.rgb, vec3(params.clamp_max)), value.a);
    // The threshold's factor is not negative.
    cotangent *= params.tint[0] * (GROUPS == GROUPS_URP ? larger(kept, vec4(0.0)) : vec4(1.0));
    if (THRESHOLDED != 0)
        cotangent =
            back_through_soft(kept, cotangent, params.threshold, unity_width(), unity_divisor(), 1e-4);
    return vec4(cotangent.rgb * larger(vec4(params.clamp_max), value).rgb, cotangent.a);
}

vec4 back_three(vec4 value, vec4 cotangent)
{
    if (THRESHOLDED == 0)
        return cotangent;
    const vec3 weights = NODE != 0 ? LUMINANCE : LONG_LUMINANCE;
    float place = (dot(value.rgb, weights) - params.threshold) / params.smooth_width;
    float t = clamp(place, 0.0, 1.0);
    float slope = t == place ? 6.0 * t * (1.0 - t) / params.smooth_width : 0.0;
    return t * t * (3.0 - 2.0 * t) * cotangent + vec4(weights, 0.0) * (slope * dot(cotangent, value));
}

vec4 back_unreal(vec4 value, vec4 cotangent)
{
    float share = unreal_share(value);
    vec2 inside = vec2(larger(vec4(share), vec4(0.0)).x, larger(vec4(1.0), vec4(share)).x);
    float slope = THRESHOLDED == 0 ? 0.0 : inside.x * inside.y * dot(cotangent, value);
    return clamp(share, 0.0, 1.0) * cotangent + vec4(slope * LUMINANCE, 0.0);
}

// The cotangents of the three values of a median.
vec4[3] back_middle(vec4 a, vec4 b, vec4 c, vec4 cotangent)
{
    vec4 low = min(a, b), high = max(a, b), held = min(high, c);
    vec4 by_low = cotangent * larger(low, held), by_held = cotangent * larger(held, low);
    vec4 by_high = by_held * larger(c, high);
    return vec4[](by_low * larger(b, a) + by_high * larger(a, b),
                  by_low * larger(a, b) + by_high * larger(b, a), by_held * larger(high, c));
}

vec4 back_kino(vec4 found[5], vec4 cotangent)
{
    vec4 values[5];
    for (int group = 0; group < 5; ++group)
        values[group] = kino_limited(found[group]);
    vec4 first = ANTI_FLICKER != 0 ? middle(values[0], values[1], values[2]) : values[0];
    vec4 second = ANTI_FLICKER != 0 ? middle(first, values[3], values[4]) : values[0];
    if (THRESHOLDED != 0) {
        float width = params.threshold * params.knee + 1e-5;
        cotangent =
            back_through_soft(second, cotangent, params.threshold, width, 4.0 * width, 1e-5);
    }
    if (ANTI_FLICKER != 0) {
        vec4 columns[3] = back_middle(first, values[3], values[4], cotangent);
        vec4 rows[3] = back_middle(values[0], values[1], values[2], columns[0]);
        cotangent = own_group < 3 ? rows[own_group] : columns[own_group - 2];
    }
    return vec4(cotangent.rgb * larger(vec4(65000.0), found[own_group]).rgb, cotangent.a);
}

// The cotangents of the group, from those of what the method makes of all groups.
vec4 back(vec4 found[5], vec4 cotangent, Place place)
{
    if (GROUPS == GROUPS_BEVY)
        return back_bevy(found, cotangent);
    if (GROUPS == GROUPS_KINO)
        return back_kino(found, cotangent);
    if (GROUPS == GROUPS_URP || GROUPS == GROUPS_POST_PROCESSING)
        return back_unity(found[0], cotangent);
    if (GROUPS == GROUPS_BABYLON)
        return babylon_factor(found[0]) * cotangent;
    if (GROUPS == GROUPS_THREE)
        return back_three(found[0], cotangent);
    if (GROUPS == GROUPS_UNREAL)
        return back_unreal(found[0], cotangent);
    if (GROUPS == GROUPS_PYGFX)
        return cotangent * larger(usual(weighted_mean(found, 5, vec4(0.0))), vec4(0.0));
    // Without weights the reduction is linear, and this is no group but all of it.
    if (GROUPS == GROUPS_FILAMENT)
        return THRESHOLDED == 0 ? cotangent : back_weighted(found, cotangent, place);
    return back_weighted(found, cotangent, place);
}

void start()
{
    place = PLACE_IN(source);
    found = means(place);
    cotangent = texelFetch(cotangents, PIXEL, 0);
    if (ALPHA != ALPHA_BLUR)
        cotangent.a = 0.0;
}

vec4 shade()
{
    own_group = LEVELS + picture;
    if (BY == BY_MASK)
        return gathered(vec4(dot(prefiltered(found, place), cotangent), 0.0, 0.0, 0.0));
    return gathered(back(found, mask_value() * cotangent, place));
}
