// What downsamplings that are not linear, and the first passes of published methods, make of their bilinear taps,
// by GROUPS.
#include "lib/groups.glsl"
#include "lib/lab.glsl"

// Bevy's: 13 taps in groups that are weighted by brightness but not renormalized, a floor, then the
// threshold (bevyengine/bevy v0.19.1, bloom.wgsl).
vec4 bevy_prefiltered(Taps taps)
{
    vec4 means[5] = group_means(taps);
    vec4 sum = vec4(0.0);
    [[unroll]] for (int group = 0; group < 5; ++group) {
        vec4 part = GROUP_SHARES[group] * means[group];
        // Bevy's buffers hold no negative values. These do, and the divisor must not become 0.
        sum += part / (1.0 + 0.25 * group_luminance(part));
    }
    sum.rgb = max(sum.rgb, vec3(1e-4));
    if (THRESHOLDED != 0) {
        float width = params.threshold * params.knee;
        sum = soft_threshold(sum, params.threshold, width, 4.0 * (width + 1e-5), 1e-5);
    }
    return sum;
}

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

// What Filament makes of the mean of four taps with these shares (google/filament,
// bloomDownsample2x.mat @ 9f62dc2f2f53).
vec4 filament_prefiltered(vec4 sum)
{
    if (THRESHOLDED != 0) {
        vec3 kept = max(sum.rgb - params.threshold, vec3(0.0));
        kept /= 1.0 + brightest(kept) / params.highlight;
        // The threshold subtracts from colours. The alpha is multiplied by the factor of the
        // brightest channel.
        float value = brightest(sum.rgb);
        sum = vec4(kept, value > 0.0 ? sum.a * (brightest(kept) / value) : 0.0);
    }
    return sum;
}

// HDRP's: the centre and four diagonal taps, at these distances in texels
// (Unity-Technologies/Graphics, com.unity.render-pipelines.high-definition, BloomPrefilter.compute
// @ 2309d2c2fde8).
const vec2 HDRP_OFFSETS[5] =
    vec2[](vec2(0.0, 0.0), vec2(HDRP_FAR, -HDRP_NEAR), vec2(-HDRP_FAR, HDRP_NEAR),
           vec2(HDRP_NEAR, HDRP_FAR), vec2(-HDRP_NEAR, -HDRP_FAR));

// Unity's: a clamp, the soft threshold, a tint. URP has no negative colours
// (Unity-Technologies/Graphics, com.unity.render-pipelines.universal, Bloom.shader @ 00d472fae509);
// Post Processing v2 has another width (Unity-Technologies/PostProcessing @ 32c3155207d3,
// Bloom.shader).
float unity_width()
{
    return params.threshold * params.knee + (GROUPS == GROUPS_URP ? 0.0 : 1e-5);
}

float unity_divisor()
{
    return 4.0 * unity_width() + (GROUPS == GROUPS_URP ? 1e-4 : 0.0);
}

vec4 unity_prefiltered(vec4 value)
{
    vec4 kept = vec4(min(value.rgb, vec3(params.clamp_max)), value.a);
    if (THRESHOLDED != 0)
        kept = soft_threshold(kept, params.threshold, unity_width(), unity_divisor(), 1e-4);
    return params.tint[0] * (GROUPS == GROUPS_URP ? max(kept, vec4(0.0)) : kept);
}

// Babylon's: a step at the luminance threshold^(1 / 2.2) (BabylonJS/Babylon.js,
// extractHighlights.fragment.fx @ bc81a5f32960).
float babylon_factor(vec4 value)
{
    return THRESHOLDED == 0 || dot(value.rgb, LUMINANCE) >= pow(params.threshold, 1.0 / 2.2) ? 1.0 : 0.0;
}

// Unreal's: the luminance above the threshold, of which 1 more is stored (Epic Games, "Bloom").
float unreal_share(vec4 value)
{
    return THRESHOLDED == 0 ? 1.0 : dot(value.rgb, LUMINANCE) + 1.0 - params.threshold;
}

// darktable's: a step of the lightness (darktable 4.2.1, src/iop/bloom.c).
vec4 darktable_prefiltered(vec4 value)
{
    float light = params.strength * lightness_of(value.rgb);
    bool bright = THRESHOLDED == 0 || light > params.threshold;
    return bright ? vec4(vec3(light / 100.0), value.a) : vec4(0.0);
}

// three.js' high pass: a smooth step of the luminance (mrdoob/three.js,
// examples/jsm/shaders/LuminosityHighPassShader.js @ 0255e15dd1d4).
vec4 three_prefiltered(vec4 value)
{
    if (THRESHOLDED == 0)
        return value;
    // BloomNode's luminance is that of three.js' colour management.
    float luminance = dot(value.rgb, NODE != 0 ? LUMINANCE : LONG_LUMINANCE);
    return value * smoothstep(params.threshold, params.threshold + params.smooth_width, luminance);
}

// KinoBloom's prefilter: the median of a texel and its neighbours, along both axes, and the soft
// threshold.

// Selects with minimum and maximum only, since arithmetic would round.
vec4 middle(vec4 a, vec4 b, vec4 c)
{
    return max(min(a, b), min(max(a, b), c));
}

vec4 kino_limited(vec4 value)
{
    return vec4(min(value.rgb, vec3(65000.0)), value.a);
}

vec4 kino_bright(vec4 centre, vec4 left, vec4 right, vec4 up, vec4 down)
{
    vec4 kept = kino_limited(centre);
    if (ANTI_FLICKER != 0) {
        kept = middle(kept, kino_limited(left), kino_limited(right));
        kept = middle(kept, kino_limited(up), kino_limited(down));
    }
    if (THRESHOLDED != 0) {
        float width = params.threshold * params.knee + 1e-5;
        kept = soft_threshold(kept, params.threshold, width, 4.0 * width, 1e-5);
    }
    return kept;
}

// The highlights of Blender's Glare node (formulas of the compositor of Blender 4.5).

// The value that a smooth transition of this width subtracts (minimum) or adds (maximum) at a
// distance from it (Quilez, "Smooth minimum").
float rounding(float distance_to_end, float width)
{
    float h = width > 0.0 ? max(1.0 - abs(distance_to_end) / width, 0.0) : 0.0;
    return 0.25 * h * h * width;
}

// The brightness above the threshold.
float highlight(float value)
{
    float low = params.threshold, range = params.maximum, high = low + range;
    // The widths are limited, so that the transitions stay between 0 and the other end.
    float at_low = min(params.smoothness, min(low, range));
    float at_high = min(params.smoothness, min(high, range));
    float above = value - low;
    float kept = max(above, 0.0) + rounding(above, at_low);
    return min(kept, range) - rounding(kept - range, at_high);
}

vec4 highlights(vec4 value)
{
    if (THRESHOLDED == 0)
        return value;
    float brightest = max(value.r, max(value.g, value.b));
    return brightest > 0.0 ? value * (highlight(brightest) / brightest) : vec4(0.0);
}

// Not one expression: glslang 12 writes invalid SPIR-V for a condition of several constants.
bool are_of_thirteen()
{
    if (GROUPS == GROUPS_PYGFX)
        return true;
    if (GROUPS == GROUPS_PYGFX_KARIS)
        return true;
    return GROUPS == GROUPS_BEVY || GROUPS == GROUPS_PYRAMID;
}

// Whether each group is a tap of its own.
bool has_own_taps()
{
    return GROUPS != GROUPS_BLENDER && !are_of_thirteen();
}

int group_count()
{
    if (!has_own_taps())
        return 5;
    if (GROUPS == GROUPS_BOX)
        return 4;
    if (GROUPS == GROUPS_FILAMENT)
        return 4;
    if (GROUPS == GROUPS_KINO)
        return ANTI_FLICKER != 0 ? 5 : 1;
    return GROUPS == GROUPS_HDRP ? 5 : 1;
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

// What the method makes of groups that are one tap each, and of Filament's shares. BOX is a box of 4 x 4 texels as
// four taps (keijiro/KinoBloom @ 0a04c43fa47d, Bloom.cginc).
vec4 made(vec4 found[5], vec4 shares)
{
    if (GROUPS == GROUPS_BOX)
        return weighted_mean(found, group_count(), shares);
    if (GROUPS == GROUPS_HDRP)
        return weighted_mean(found, group_count(), shares);
    if (GROUPS == GROUPS_FILAMENT)
        return filament_prefiltered(weighted_mean(found, group_count(), shares));
    if (GROUPS == GROUPS_KINO)
        return kino_bright(found[0], found[1], found[2], found[3], found[4]);
    if (GROUPS == GROUPS_HIGHLIGHTS)
        return highlights(found[0]);
    if (GROUPS == GROUPS_BABYLON)
        return babylon_factor(found[0]) * found[0];
    if (GROUPS == GROUPS_THREE)
        return three_prefiltered(found[0]);
    if (GROUPS == GROUPS_UNREAL)
        return clamp(unreal_share(found[0]), 0.0, 1.0) * found[0];
    if (GROUPS == GROUPS_DARKTABLE)
        return darktable_prefiltered(found[0]);
    return unity_prefiltered(found[0]);
}
