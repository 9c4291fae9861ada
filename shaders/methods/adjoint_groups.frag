#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The cotangents of the groups of taps from which a downsampling makes a pixel, where it is not linear
// in these: of group number LEVELS, or of the mask.
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/sampling.glsl"
#include "lib/threshold.glsl"
#include "lib/threshold_slope.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/prefilters.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 3) uniform sampler2D cotangents;

#define TARGET_BINDING 6
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"
#include "lib/kino.glsl"
#include "lib/adjoint.glsl"
#include "lib/thirteen_taps.glsl"

// Not one expression: glslang 12 writes invalid SPIR-V for a condition of several constants.
int group_count()
{
    if (GROUPS == GROUPS_BOX)
        return 4;
    if (GROUPS == GROUPS_URP)
        return 1;
    if (GROUPS == GROUPS_UNREAL)
        return 1;
    if (GROUPS == GROUPS_KINO)
        return ANTI_FLICKER != 0 ? 5 : 1;
    return 5;
}

// The place of a tap that is a group of its own, in texels.
vec2 place_of(int group)
{
    if (GROUPS == GROUPS_BOX)
        return 2.0 * vec2(group & 1, group >> 1) - 1.0;
    const vec2 cross[5] = vec2[](vec2(0, 0), vec2(-1, 0), vec2(1, 0), vec2(0, -1), vec2(0, 1));
    return cross[group];
}

vec4[5] means()
{
    Place place = PLACE_IN(source);
    if (GROUPS == GROUPS_BEVY || GROUPS == GROUPS_PYRAMID)
        return group_means(thirteen_taps(place, vec2(params.step_x, params.step_y)));
    vec4 found[5] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
    for (int group = 0; group < group_count(); ++group)
        found[group] = sample_at(source, place, place_of(group), SAMPLING);
    return found;
}

// A group's weight by brightness, and its derivative by the colour.
float weight_of(vec4 mean, int group, out vec3 slope)
{
    bool box = GROUPS == GROUPS_BOX;
    float share = box ? 1.0 : GROUP_SHARES[group];
    float brightness = box ? brightest_channel(mean) : group_luminance(mean);
    float weight = share / (1.0 + brightness);
    slope = brightness > 0.0 ? -weight / (1.0 + brightness)
                                   * (box ? shares_of_brightest(mean.rgb) : LUMINANCE)
                             : vec3(0.0);
    return weight;
}

vec4 back_weighted(vec4 found[5], vec4 brought)
{
    vec3 slope, own_slope = vec3(0.0);
    vec4 sum = vec4(0.0), own = vec4(0.0);
    float total = 0.0, own_weight = 0.0;
    for (int group = 0; group < group_count(); ++group) {
        float weight = weight_of(found[group], group, slope);
        sum += weight * found[group];
        total += weight;
        if (group == LEVELS) {
            own = found[group];
            own_weight = weight;
            own_slope = slope;
        }
    }
    return (own_weight * brought + vec4(own_slope, 0.0) * dot(brought, own - sum / total)) / total;
}

vec4 back_bevy(vec4 found[5], vec4 brought)
{
    vec4 sum = vec4(0.0), own = vec4(0.0);
    float own_luminance = 0.0, own_share = 0.0;
    for (int group = 0; group < 5; ++group) {
        vec4 part = GROUP_SHARES[group] * found[group];
        float luminance = group_luminance(part);
        sum += part / (1.0 + 0.25 * luminance);
        if (group == LEVELS) {
            own = part;
            own_luminance = luminance;
            own_share = GROUP_SHARES[group];
        }
    }
    if (THRESHOLDED != 0) {
        float width = params.threshold * params.knee;
        brought = back_through_soft(vec4(max(sum.rgb, vec3(1e-4)), sum.a), brought, params.threshold,
                                    width, 4.0 * (width + 1e-5), 1e-5);
    }
    brought.rgb *= vec3(greaterThan(sum.rgb, vec3(1e-4)));
    float divisor = 1.0 + 0.25 * own_luminance;
    float slope = own_luminance > 0.0 ? 0.25 * dot(brought, own) / (divisor * divisor) : 0.0;
    return own_share * (brought / divisor - vec4(slope * LUMINANCE, 0.0));
}

vec4 back_urp(vec4 value, vec4 brought)
{
    vec4 kept = vec4(min(value.rgb, vec3(params.clamp_max)), value.a);
    brought *= vec4(greaterThan(urp_prefiltered(value), vec4(0.0)));
    if (THRESHOLDED != 0) {
        float width = params.threshold * params.knee;
        brought =
            back_through_soft(kept, brought, params.threshold, width, 4.0 * width + 1e-4, 1e-4);
    }
    return vec4(brought.rgb * vec3(lessThan(value.rgb, vec3(params.clamp_max))), brought.a);
}

vec4 back_unreal(vec4 value, vec4 brought)
{
    if (THRESHOLDED == 0)
        return brought;
    const vec3 weights = NODE != 0 ? vec3(0.2126, 0.7152, 0.0722)
                                   : vec3(0.2126729, 0.7151522, 0.0721750);
    float place = (dot(value.rgb, weights) - params.threshold) / params.smooth_width;
    float t = clamp(place, 0.0, 1.0);
    float slope = t == place ? 6.0 * t * (1.0 - t) / params.smooth_width : 0.0;
    return t * t * (3.0 - 2.0 * t) * brought + vec4(weights, 0.0) * (slope * dot(brought, value));
}

// 1 where a is larger, a half where both are equal.
vec4 larger(vec4 a, vec4 b)
{
    return vec4(greaterThan(a, b)) + 0.5 * vec4(equal(a, b));
}

// The cotangents of the three values of a median.
vec4[3] back_middle(vec4 a, vec4 b, vec4 c, vec4 brought)
{
    vec4 low = min(a, b), high = max(a, b), held = min(high, c);
    vec4 by_low = brought * larger(low, held), by_held = brought * larger(held, low);
    vec4 by_high = by_held * larger(c, high);
    return vec4[](by_low * larger(b, a) + by_high * larger(a, b),
                  by_low * larger(a, b) + by_high * larger(b, a), by_held * larger(high, c));
}

vec4 back_kino(vec4 found[5], vec4 brought)
{
    vec4 values[5];
    for (int group = 0; group < 5; ++group)
        values[group] = kino_limited(found[group]);
    vec4 first = ANTI_FLICKER != 0 ? middle(values[0], values[1], values[2]) : values[0];
    vec4 second = ANTI_FLICKER != 0 ? middle(first, values[3], values[4]) : values[0];
    if (THRESHOLDED != 0) {
        float width = params.threshold * params.knee + 1e-5;
        brought =
            back_through_soft(second, brought, params.threshold, width, 4.0 * width, 1e-5);
    }
    if (ANTI_FLICKER != 0) {
        vec4 columns[3] = back_middle(first, values[3], values[4], brought);
        vec4 rows[3] = back_middle(values[0], values[1], values[2], columns[0]);
        brought = LEVELS < 3 ? rows[LEVELS] : columns[LEVELS - 2];
    }
    return vec4(brought.rgb * vec3(lessThan(found[LEVELS].rgb, vec3(65000.0))), brought.a);
}

vec4 prefiltered(vec4 found[5])
{
    if (GROUPS == GROUPS_BEVY) {
        Taps taps = thirteen_taps(PLACE_IN(source), vec2(params.step_x, params.step_y));
        return bevy_prefiltered(taps);
    }
    if (GROUPS == GROUPS_KINO)
        return kino_bright(found[0], found[1], found[2], found[3], found[4]);
    return GROUPS == GROUPS_URP ? urp_prefiltered(found[0]) : unreal_prefiltered(found[0]);
}

vec4 shade()
{
    vec4 found[5] = means(), brought = texelFetch(cotangents, PIXEL, 0);
    if (ALPHA != ALPHA_BLUR)
        brought.a = 0.0;
    if (BY == BY_MASK)
        return gathered(vec4(dot(prefiltered(found), brought), 0.0, 0.0, 0.0));
    brought *= mask_value();
    if (GROUPS == GROUPS_PYRAMID || GROUPS == GROUPS_BOX)
        return gathered(back_weighted(found, brought));
    if (GROUPS == GROUPS_BEVY)
        return gathered(back_bevy(found, brought));
    if (GROUPS == GROUPS_KINO)
        return gathered(back_kino(found, brought));
    return gathered(GROUPS == GROUPS_URP ? back_urp(found[0], brought)
                                         : back_unreal(found[0], brought));
}
