// The samples of a downsampling that is not linear in groups of its taps, or of the first pass of a published
// method, and what it makes of them. The including shader has PREFILTER_BLOCK and `source`, and
// includes fullscreen.glsl and prefilters.glsl before this file.
#include "lib/thirteen_taps.glsl"
#include "lib/mean_of_texels.glsl"

Taps taps_of(Place place)
{
    return thirteen_taps(place, EXACT == EXACT_HALF ? vec2(1.0) : vec2(params.step_x, params.step_y));
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
    return GROUPS == GROUPS_BLENDER ? blender_groups(taps_of(place)) : made(found, place.part);
}
