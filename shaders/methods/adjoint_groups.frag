// The cotangents of the groups of taps from which a downsampling makes a pixel, where it is not linear
// in these: of STACKED_GROUPS groups from number OWN_GROUP on, or of the mask.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/prefilters.glsl"

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#define STACKED STACKED_GROUPS
#define STACKED_HEIGHT params.target_height
#include "lib/fullscreen.glsl"
#include "lib/mask.glsl"
#include "lib/adjoint.glsl"
#include "lib/prefilter_taps.glsl"

// The group whose cotangents are wanted, what the groups are, and the cotangents of the pixel.
int own_group;
Place place;
vec4 found[5], cotangent;

// Through bright_part().
vec4 back_bright_part(vec4 value, vec4 cotangent)
{
    if (is_plain())
        return cotangent;
    if (GROUPS == GROUPS_PYGFX || GROUPS == GROUPS_PYGFX_KARIS)
        return mix(vec4(0.0), cotangent * larger(value, vec4(0.0)), is_usual(value));
    if (THRESHOLDED != 0 && GROUPS == GROUPS_FILAMENT) {
        vec4 above = part_above(value, params.threshold);
        float divisor = 1.0 + largest(above.rgb) / params.highlight;
        // The product with the result, not with what is above, which may overflow.
        vec3 slope = shares_of_brightest(above.rgb) / (-params.highlight * divisor);
        vec4 factor = vec4(slope, 1.0 / divisor);
        return back_part_above(value, back_through_factor(above / divisor, factor, cotangent), params.threshold);
    }
    vec4 held = GROUPS == GROUPS_BEVY ? vec4(max(value.rgb, vec3(1e-4)), value.a) : value;
    cotangent *= params.tint[0];
    // The threshold's factor is not negative.
    if (CLAMPED != 0)
        cotangent *= larger(value, vec4(0.0));
    if (THRESHOLDED != 0)
        cotangent = back_through_factor(held, factor_of(held.rgb), cotangent);
    if (GROUPS == GROUPS_BEVY)
        cotangent.rgb *= larger(value, vec4(1e-4)).rgb;
    return cotangent;
}

// Through the weighted mean.
vec4 back_mean(vec4 mean, vec4 cotangent)
{
    float shares[5] = shares_of(place.part);
    vec4 own = found[own_group], apart = GROUPS == GROUPS_BEVY ? own : own - mean;
    Weight weight = weight_of(own, shares[own_group]);
    vec4 factor = vec4(weight.slope, weight.value) / sum_of(found, shares).weights;
    return factor.a * cotangent + vec4(factor.rgb * dot(cotangent, apart), 0.0);
}

// Blender's groups are each of four of 13 taps, and these are what has cotangents: nine outer ones in three rows, then
// the inner ones.
Taps taps;
float sums_of_weights[5];

void start_taps()
{
    taps = taps_of(place);
    found = group_means(taps);
    [[unroll]] for (int group = 0; group < 5; ++group) {
        vec4 four[4] = taps_of_group(taps, group);
        sums_of_weights[group] = 0.0;
        [[unroll]] for (int i = 0; i < 4; ++i)
            sums_of_weights[group] += blender_weight(four[i]).value;
    }
}

bool is_in_group(int group)
{
    ivec2 corner = ivec2(group - 1 & 1, group - 1 >> 1), step = ivec2(own_group % 3, own_group / 3) - corner;
    if (group == 0 || own_group >= 9)
        return group == 0 && own_group >= 9;
    return (step.x & 1) == step.x && (step.y & 1) == step.y;
}

vec4 back_tap(vec4 cotangent)
{
    vec4 own = own_group >= 9 ? taps.inner[own_group - 9] : taps.outer[own_group], total = vec4(0.0);
    Weight weight = blender_weight(own);
    [[unroll]] for (int group = 0; group < 5; ++group)
        if (is_in_group(group)) {
            vec4 by_weight = vec4(weight.slope * dot(cotangent, own - found[group]), 0.0);
            total += GROUP_SHARES[group] / sums_of_weights[group] * (weight.value * cotangent + by_weight);
        }
    return usual(total);
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

// Through the medians along both axes.
vec4 back_medians(vec4 cotangent)
{
    vec4 a = capped(found[0]), b = capped(found[1]), c = capped(found[2]);
    vec4 columns[3] =
        back_middle(middle(a, b, c), capped(found[3]), capped(found[4]), cotangent);
    vec4 rows[3] = back_middle(a, b, c, columns[0]);
    return own_group < 3 ? rows[own_group] : columns[own_group - 2];
}

// The cotangents of the group, from those of what the method makes of all groups.
vec4 back(vec4 cotangent)
{
    if (GROUPS == GROUPS_HIGHLIGHTS)
        return back_highlights(found[0], cotangent);
    if (GROUPS == GROUPS_DARKTABLE)
        return back_darktable(found[0], cotangent);
    vec4 combination = combined(found, place.part);
    if (GROUPS == GROUPS_BLENDER)
        return back_tap(mix(vec4(0.0), cotangent, equal(usual(combination), combination)));
    cotangent = back_bright_part(combination, cotangent);
    // The reduction is linear, and this is no group but all of it.
    if (GROUPS == GROUPS_PYGFX)
        return cotangent;
    // What they would be multiplied by may be infinite.
    if (cotangent == vec4(0.0))
        return cotangent;
    if (group_count() > 1)
        cotangent = GROUPS == GROUPS_KINO ? back_medians(cotangent) : back_mean(combination, cotangent);
    if (is_capped())
        cotangent.rgb *= larger(vec4(cap()), found[own_group]).rgb;
    return cotangent;
}

void start()
{
    place = PLACE_IN(source);
    if (GROUPS == GROUPS_BLENDER)
        start_taps();
    else
        found = means(place);
    cotangent = texelFetch(cotangents, PIXEL, 0);
    if (ALPHA != ALPHA_BLUR)
        cotangent.a = 0.0;
}

vec4 shade()
{
    own_group = OWN_GROUP + picture;
    if (BY == BY_MASK)
        return gathered(vec4(dot(made(found, place.part), cotangent), 0.0, 0.0, 0.0));
    return gathered(back(mask_value() * cotangent));
}
