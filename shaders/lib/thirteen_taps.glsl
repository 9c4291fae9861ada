// The 13 taps of a downsample: nine in three rows, and four around the centre (Jimenez, "Next Generation
// Post Processing in Call of Duty: Advanced Warfare", SIGGRAPH 2014). The including shader defines
// `source` and SAMPLING, and includes groups.glsl.

vec4 tap(Place place, float x, float y)
{
    return sample_at(source, place, vec2(x, y), SAMPLING);
}

// `apart` is the distance of the inner taps from the centre, in texels of the source.
Taps thirteen_taps(Place place, vec2 apart)
{
    float x = 2.0 * apart.x, y = 2.0 * apart.y;
    Taps taps;
    taps.outer = vec4[](tap(place, -x, -y), tap(place, 0.0, -y), tap(place, x, -y),
                        tap(place, -x, 0.0), tap(place, 0.0, 0.0), tap(place, x, 0.0),
                        tap(place, -x, y), tap(place, 0.0, y), tap(place, x, y));
    taps.inner = vec4[](tap(place, -apart.x, -apart.y), tap(place, apart.x, -apart.y),
                        tap(place, -apart.x, apart.y), tap(place, apart.x, apart.y));
    return taps;
}
