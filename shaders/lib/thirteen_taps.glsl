// The 13 taps of a downsample: nine in three rows, and four around the centre (Jimenez, "Next Generation
// Post Processing in Call of Duty: Advanced Warfare", SIGGRAPH 2014). The including shader defines
// `source` and SAMPLING, and includes groups.glsl.

vec4 tap(Place place, float x, float y)
{
    return sample_at(source, place, vec2(x, y), SAMPLING);
}

#ifdef DISPATCH
// The taps where the inner ones are one texel from the centre. Then taps share texels: 36 are read in
// place of 52.
Taps whole_taps(Place place)
{
    ivec2 first = place.texel - 2, last = textureSize(source, 0) - 1;
    vec2 parts[5];
    vec4 above[5], row[5], texels[6];
    Taps taps;

    // As sample_at() rounds them: the offset may round to the next texel.
    [[unroll]] for (int i = 0; i < 5; ++i) {
        vec2 moved = place.part + float(i - 2), integer = floor(moved);
        parts[i] = mix(vec2(1.0), moved - integer, equal(integer, vec2(i - 2)));
    }
    [[unroll]] for (int y = 0; y < 6; ++y) {
        [[unroll]] for (int x = 0; x < 6; ++x)
            texels[x] = TEXEL(texelFetch(source, clamp(first + ivec2(x, y), ivec2(0), last), 0));
        [[unroll]] for (int x = 0; x < 5; ++x)
            row[x] = blended(texels[x], texels[x + 1], parts[x].x);
        if ((y & 1) == 1)
            [[unroll]] for (int x = 0; x < 3; ++x)
                taps.outer[3 * (y / 2) + x] = blended(above[2 * x], row[2 * x], parts[y - 1].y);
        else if (y > 0)
            [[unroll]] for (int x = 0; x < 2; ++x)
                taps.inner[y - 2 + x] = blended(above[2 * x + 1], row[2 * x + 1], parts[y - 1].y);
        above = row;
    }
    return taps;
}
#endif

// `apart` is the distance of the inner taps from the centre, in texels of the source.
Taps thirteen_taps(Place place, vec2 apart)
{
#ifdef DISPATCH
    if (SAMPLING == SAMPLING_FETCH && apart == vec2(1.0))
        return whole_taps(place);
#endif
    float x = 2.0 * apart.x, y = 2.0 * apart.y;
    Taps taps;
    taps.outer = vec4[](tap(place, -x, -y), tap(place, 0.0, -y), tap(place, x, -y),
                        tap(place, -x, 0.0), tap(place, 0.0, 0.0), tap(place, x, 0.0),
                        tap(place, -x, y), tap(place, 0.0, y), tap(place, x, y));
    taps.inner = vec4[](tap(place, -apart.x, -apart.y), tap(place, apart.x, -apart.y),
                        tap(place, -apart.x, apart.y), tap(place, apart.x, apart.y));
    return taps;
}
