// The samples of a downsampling that is not linear in groups of its taps, or of the first pass of a published
// method, and what it makes of them. The including shader has PREFILTER_BLOCK and `source`, and
// includes fullscreen.glsl and prefilters.glsl before this file.

vec4 tap(Place place, float x, float y)
{
    return sample_at(source, place, vec2(x, y), SAMPLING);
}

// The 13 taps: nine in three rows, and four around the centre (Jimenez, "Next Generation Post Processing in Call of
// Duty: Advanced Warfare", SIGGRAPH 2014).
Taps taps_of(Place place)
{
    // The distance of the inner taps from the centre, in texels of the source.
    vec2 apart = vec2(params.step_x, params.step_y);
    float x = 2.0 * apart.x, y = 2.0 * apart.y;
    Taps taps;
    taps.outer = vec4[](tap(place, -x, -y), tap(place, 0.0, -y), tap(place, x, -y),
                        tap(place, -x, 0.0), tap(place, 0.0, 0.0), tap(place, x, 0.0),
                        tap(place, -x, y), tap(place, 0.0, y), tap(place, x, y));
    taps.inner = vec4[](tap(place, -apart.x, -apart.y), tap(place, apart.x, -apart.y),
                        tap(place, -apart.x, apart.y), tap(place, apart.x, apart.y));
    return taps;
}

// The mean of count x count texels for a pixel of a target of this height. Blender counts rows from the
// bottom, and repeats the last ones.
vec4 mean_of_texels(sampler2D source, ivec2 pixel, int height, int count)
{
    ivec2 first = count * ivec2(pixel.x, height - 1 - pixel.y);
    int last = textureSize(source, 0).y - 1;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < count; ++y)
        for (int x = 0; x < count; ++x)
            sum += fetch_clamped(source, ivec2(first.x + x, last - first.y - y));
    return sum / float(count * count);
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
