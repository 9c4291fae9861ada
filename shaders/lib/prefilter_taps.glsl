// The taps of a downsampling that is not linear in groups of its taps, or of the first pass of a published
// method, by GROUPS, and what it makes of them. The including shader has PREFILTER_BLOCK and `source`, and
// includes fullscreen.glsl and prefilters.glsl before this file.
#include "lib/kino.glsl"
#include "lib/thirteen_taps.glsl"
#include "lib/highlights.glsl"
#include "lib/mean_of_texels.glsl"

// Not one expression: glslang 12 writes invalid SPIR-V for a condition of several constants.
int group_count()
{
    if (GROUPS == GROUPS_BOX)
        return 4;
    if (GROUPS == GROUPS_FILAMENT)
        return 4;
    if (GROUPS == GROUPS_URP)
        return 1;
    if (GROUPS == GROUPS_POST_PROCESSING)
        return 1;
    if (GROUPS == GROUPS_UNREAL)
        return 1;
    if (GROUPS == GROUPS_THREE)
        return 1;
    if (GROUPS == GROUPS_BABYLON)
        return 1;
    if (GROUPS == GROUPS_HIGHLIGHTS)
        return 1;
    if (GROUPS == GROUPS_KINO)
        return ANTI_FLICKER != 0 ? 5 : 1;
    return 5;
}

bool are_of_thirteen()
{
    if (GROUPS == GROUPS_PYGFX)
        return true;
    if (GROUPS == GROUPS_PYGFX_KARIS)
        return true;
    return GROUPS == GROUPS_BEVY || GROUPS == GROUPS_PYRAMID;
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

Taps taps_of(Place place)
{
    return thirteen_taps(place, vec2(params.step_x, params.step_y));
}

vec4[5] means(Place place)
{
    if (are_of_thirteen())
        return group_means(taps_of(place));
    FilamentTaps pairs = filament_taps(place.part);
    vec4 found[5] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
    // Its groups share their taps.
    if (GROUPS == GROUPS_BLENDER)
        return found;
    [[unroll]] for (int group = 0; group < 5; ++group)
        if (group < group_count())
            found[group] = sample_at(source, place, place_of(group, pairs), SAMPLING);
    // Only Blender's highlights are of blocks of texels.
    if (RADIUS > 1)
        found[0] = mean_of_texels(source, PIXEL, params.target_height, RADIUS);
    return found;
}

vec4 prefiltered(vec4 found[5], Place place)
{
    vec4 four[4] = vec4[](found[0], found[1], found[2], found[3]);
    if (GROUPS == GROUPS_BEVY)
        return bevy_prefiltered(taps_of(place));
    if (GROUPS == GROUPS_BOX)
        return box_of(four);
    if (GROUPS == GROUPS_KINO)
        return kino_bright(found[0], found[1], found[2], found[3], found[4]);
    if (GROUPS == GROUPS_FILAMENT)
        return filament_prefiltered(four, filament_taps(place.part).shares);
    if (GROUPS == GROUPS_HDRP)
        return hdrp_prefiltered(found);
    if (GROUPS == GROUPS_HIGHLIGHTS)
        return highlights(found[0]);
    if (GROUPS == GROUPS_URP)
        return unity_prefiltered(found[0]);
    if (GROUPS == GROUPS_POST_PROCESSING)
        return unity_prefiltered(found[0]);
    if (GROUPS == GROUPS_BABYLON)
        return babylon_factor(found[0]) * found[0];
    if (GROUPS == GROUPS_THREE)
        return three_prefiltered(found[0]);
    if (GROUPS == GROUPS_UNREAL)
        return clamp(unreal_share(found[0]), 0.0, 1.0) * found[0];
    return combined(taps_of(place));
}
