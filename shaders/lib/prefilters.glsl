// What downsamplings that are not linear, and the first passes of published methods, make of their bilinear taps,
// by GROUPS.
#include "lib/groups.glsl"
#include "lib/lab.glsl"

// The shares of Filament's four taps, and the distances of the first and the last of them. Along an
// axis the texels at -1 .. 2 have the weights (1 - f, 2 - f, 1 + f, f) / 4. Two bilinear taps, each
// between two texels, give these weights.
struct FilamentTaps {
    vec4 shares;
    vec2 left, right;
};

FilamentTaps filament_taps(vec2 part)
{
    vec2 left_share = 0.25 * (3.0 - 2.0 * part), right_share = 0.25 * (1.0 + 2.0 * part);
    vec4 shares = vec4(left_share.x, right_share.x, left_share.x, right_share.x)
                * vec4(left_share.yy, right_share.yy);
    return FilamentTaps(shares, (2.0 - part) / (3.0 - 2.0 * part) - 1.0 - part,
                        1.0 + part / (1.0 + 2.0 * part) - part);
}

// Of each group.
float[5] shares_of(vec2 part)
{
    if (GROUPS == GROUPS_FILAMENT) {
        vec4 shares = filament_taps(part).shares;
        return float[](shares.x, shares.y, shares.z, shares.w, 0.0);
    }
    return are_of_thirteen() && GROUPS != GROUPS_PYGFX_KARIS ? GROUP_SHARES : ONES;
}

// HDRP's: the centre and four diagonal taps, at these distances in texels, weighted against fireflies
// (Karis 2013; Unity-Technologies/Graphics, com.unity.render-pipelines.high-definition,
// BloomPrefilter.compute @ 2309d2c2fde8).
const vec2 HDRP_OFFSETS[5] =
    vec2[](vec2(0.0, 0.0), vec2(HDRP_FAR, -HDRP_NEAR), vec2(-HDRP_FAR, HDRP_NEAR),
           vec2(HDRP_NEAR, HDRP_FAR), vec2(-HDRP_NEAR, -HDRP_FAR));

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
    float slope = (kept.y - factor) * dot(cotangent, value / brightest);
    return factor * cotangent + vec4(slope * shares_of_brightest(value.rgb), 0.0);
}

// darktable's: a step of the lightness (darktable 4.2.1, src/iop/bloom.c).
vec4 darktable_prefiltered(vec4 value)
{
    float light = params.strength * lightness_of(value.rgb);
    bool bright = THRESHOLDED == 0 || light > params.threshold;
    return bright ? vec4(vec3(light / 100.0), value.a) : vec4(0.0);
}

vec4 back_darktable(vec4 value, vec4 cotangent)
{
    float light = params.strength * lightness_of(value.rgb);
    bool bright = THRESHOLDED == 0 || light > params.threshold;
    float by_light = (cotangent.r + cotangent.g + cotangent.b) * params.strength * 1.16;
    return bright ? vec4(by_light * lab_slope(value.rgb).y * WHITE_SHARES[1], cotangent.a) : vec4(0.0);
}

// The place of a tap that is a group of its own, in texels.
vec2 place_of(int group, FilamentTaps pairs)
{
    if (GROUPS == GROUPS_BOX)
        return 2.0 * vec2(group & 1, group >> 1) - 1.0;
    if (GROUPS == GROUPS_FILAMENT)
        return mix(pairs.left, pairs.right, bvec2((group & 1) != 0, (group & 2) != 0));
    if (GROUPS == GROUPS_HDRP)
        return HDRP_OFFSETS[group];
    const vec2 cross[5] = vec2[](vec2(0, 0), vec2(-1, 0), vec2(1, 0), vec2(0, -1), vec2(0, 1));
    return cross[group];
}

// Whether texels have an upper bound.
bool is_capped()
{
    if (GROUPS == GROUPS_KINO)
        return true;
    return GROUPS == GROUPS_URP || GROUPS == GROUPS_POST_PROCESSING;
}

float cap()
{
    return GROUPS == GROUPS_KINO ? 65000.0 : params.clamp_max;
}

vec4 capped(vec4 value)
{
    return vec4(min(value.rgb, vec3(cap())), value.a);
}

// Selects with minimum and maximum only, since arithmetic would round.
vec4 middle(vec4 a, vec4 b, vec4 c)
{
    return max(min(a, b), min(max(a, b), c));
}

// Kino's is the median of a texel and its neighbours, along both axes (keijiro/KinoBloom @ 0a04c43fa47d,
// Bloom.cginc).
vec4 combined(vec4 groups[5], vec2 part)
{
    if (is_capped())
        [[unroll]] for (int group = 0; group < 5; ++group)
            groups[group] = capped(groups[group]);
    if (group_count() == 1)
        return groups[0];
    if (GROUPS == GROUPS_KINO)
        return middle(middle(groups[0], groups[1], groups[2]), groups[3], groups[4]);
    Sum sum = sum_of(groups, shares_of(part));
    return sum.value / sum.weights;
}

// three.js' high pass: a smooth step of the luminance (mrdoob/three.js,
// examples/jsm/shaders/LuminosityHighPassShader.js @ 0255e15dd1d4).
vec4 three_factor(vec3 colour)
{
    // BloomNode's luminance is that of three.js' colour management.
    const vec3 weights = NODE != 0 ? LUMINANCE : vec3(0.2126729, 0.7151522, 0.0721750);
    float luminance = dot(colour, weights);
    float place = (luminance - params.threshold) / params.smooth_width, t = clamp(place, 0.0, 1.0);
    float slope = t == place ? 6.0 * t * (1.0 - t) / params.smooth_width : 0.0;
    // Not smoothstep(), which is undefined where rounding makes both ends equal.
    return vec4(slope * weights, t * t * (3.0 - 2.0 * t));
}

// Unreal's: the luminance above the threshold, of which 1 more is stored (Epic Games, "Bloom").
vec4 unreal_factor(vec3 colour)
{
    float share = dot(colour, LUMINANCE) + 1.0 - params.threshold;
    return vec4(larger(share, 0.0) * larger(1.0, share) * LUMINANCE, clamp(share, 0.0, 1.0));
}

// The factor of a colour by its brightness, in alpha, and its derivatives by the channels. Unity's of Post
// Processing v2 has another width (Unity-Technologies/PostProcessing @ 32c3155207d3, Bloom.shader), Babylon's
// is a step at the luminance threshold^(1 / 2.2) (BabylonJS/Babylon.js, extractHighlights.fragment.fx
// @ bc81a5f32960).
vec4 factor_of(vec3 colour)
{
    float width = params.threshold * params.knee, wider = width + 1e-5;
    bool is_unity = GROUPS == GROUPS_URP || GROUPS == GROUPS_POST_PROCESSING;
    bool is_wider = GROUPS == GROUPS_KINO || GROUPS == GROUPS_POST_PROCESSING;
    float divisor = GROUPS == GROUPS_URP ? 4.0 * width + 1e-4 : 4.0 * wider;
    if (GROUPS == GROUPS_BABYLON)
        return vec4(vec3(0.0), float(dot(colour, LUMINANCE) >= pow(params.threshold, 1.0 / 2.2)));
    if (GROUPS == GROUPS_THREE)
        return three_factor(colour);
    if (GROUPS == GROUPS_UNREAL)
        return unreal_factor(colour);
    return soft_factor(colour, params.threshold, is_wider ? wider : width, divisor,
                       is_unity ? 1e-4 : 1e-5);
}

// Whether the combined groups are the result.
bool is_plain()
{
    if (GROUPS == GROUPS_PYRAMID)
        return true;
    return GROUPS == GROUPS_BOX || GROUPS == GROUPS_HDRP;
}

// What a method makes of the combined groups. Bevy's has a floor before the threshold (bevyengine/bevy
// v0.19.1, bloom.wgsl). Filament's threshold subtracts (google/filament, bloomDownsample2x.mat
// @ 9f62dc2f2f53). CLAMPED: without negative colours, as URP (Unity-Technologies/Graphics,
// com.unity.render-pipelines.universal, Bloom.shader @ 00d472fae509).
vec4 bright_part(vec4 value)
{
    if (is_plain())
        return value;
    if (GROUPS == GROUPS_BLENDER)
        return usual(value);
    if (GROUPS == GROUPS_PYGFX || GROUPS == GROUPS_PYGFX_KARIS)
        return max(usual(value), vec4(0.0));
    if (GROUPS == GROUPS_BEVY)
        value.rgb = max(value.rgb, vec3(1e-4));
    if (THRESHOLDED != 0 && GROUPS == GROUPS_FILAMENT) {
        value = part_above(value, params.threshold);
        return value / (1.0 + largest(value.rgb) / params.highlight);
    }
    if (THRESHOLDED != 0)
        value *= factor_of(value.rgb).a;
    if (CLAMPED != 0)
        value = max(value, vec4(0.0));
    return params.tint[0] * value;
}

vec4 made(vec4 groups[5], vec2 part)
{
    if (GROUPS == GROUPS_HIGHLIGHTS)
        return highlights(groups[0]);
    if (GROUPS == GROUPS_DARKTABLE)
        return darktable_prefiltered(groups[0]);
    return bright_part(combined(groups, part));
}
