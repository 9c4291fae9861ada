// The samples of a pass with PREFILTER_BLOCK and `source`, in a shader that includes fullscreen.glsl and prefilter.glsl
// before this file.

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

vec4[MAX_SET_TAPS] taps_at(Place place)
{
    // How far apart places are, in texels of the source. A constant is one where compilers see which texels taps share:
    // its first level takes `jimenez2014` 0.30 ms in place of 0.41 (3840 x 2160, float16, H100, 2026-11-27).
    vec2 apart = EXACT == EXACT_HALF ? vec2(1.0) : vec2(params.step_x, params.step_y);
    vec4 taps[MAX_SET_TAPS];
    [[unroll]] for (int i = 0; i < MAX_SET_TAPS; ++i)
        taps[i] = i < tap_count() ? sample_at(source, place, apart * place_of(i, place.part), SAMPLING) : vec4(0.0);
    // Only Blender's highlights are of blocks of texels.
    if (MEAN_SIDE > 1)
        taps[0] = mean_of_texels(source, PIXEL, params.target_height, MEAN_SIDE);
    return taps;
}
