// The samples of a downsampling that is not linear in groups of its taps, or of the first pass of a published
// method, and what it makes of them. The including shader has PREFILTER_BLOCK and `source`, and
// includes fullscreen.glsl and prefilters.glsl before this file.

// The 13 taps: nine in three rows, and four around the centre (Jimenez, "Next Generation Post Processing in Call of
// Duty: Advanced Warfare", SIGGRAPH 2014).
Taps taps_of(Place place)
{
    // The distance of the inner taps from the centre, in texels of the source. A constant is one where compilers see
    // which texels taps share: its first level takes `jimenez2014` 0.30 ms in place of 0.41 (3840 x 2160, float16, H100,
    // 2026-11-27).
    vec2 apart = EXACT == EXACT_HALF ? vec2(1.0) : vec2(params.step_x, params.step_y);
    Taps taps;
    [[unroll]] for (int i = 0; i < 9; ++i)
        taps.outer[i] = sample_at(source, place, 2.0 * apart * (vec2(i % 3, i / 3) - 1.0), SAMPLING);
    [[unroll]] for (int i = 0; i < 4; ++i)
        taps.inner[i] = sample_at(source, place, apart * (2.0 * vec2(i % 2, i / 2) - 1.0), SAMPLING);
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
    [[unroll]] for (int group = 0; group < 5; ++group)
        if (group < group_count())
            found[group] = sample_at(source, place, place_of(group, pairs), SAMPLING);
    // Only Blender's highlights are of blocks of texels.
    if (MEAN_SIDE > 1)
        found[0] = mean_of_texels(source, PIXEL, params.target_height, MEAN_SIDE);
    return found;
}
