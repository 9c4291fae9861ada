// The 13 taps of a downsample as five 2 x 2 groups; the middle one has half of the weight (Jimenez,
// "Next Generation Post Processing in Call of Duty: Advanced Warfare", SIGGRAPH 2014). The including
// shader defines `source` and SAMPLING.

const float GROUP_SHARES[5] = float[](0.5, 0.125, 0.125, 0.125, 0.125);

vec4 tap(Place place, float x, float y)
{
    return sample_at(source, place, vec2(x, y), SAMPLING);
}

// `apart` is the distance of the inner taps from the centre, in texels of the source.
vec4[5] group_means(Place place, vec2 apart)
{
    float x = 2.0 * apart.x, y = 2.0 * apart.y;
    // Rows of taps, left to right. Then the four inner taps.
    vec4 a = tap(place, -x, -y), b = tap(place, 0.0, -y), c = tap(place, x, -y);
    vec4 d = tap(place, -x, 0.0), e = tap(place, 0.0, 0.0), f = tap(place, x, 0.0);
    vec4 g = tap(place, -x, y), h = tap(place, 0.0, y), i = tap(place, x, y);
    vec4 inner = tap(place, -apart.x, -apart.y) + tap(place, apart.x, -apart.y)
               + tap(place, -apart.x, apart.y) + tap(place, apart.x, apart.y);
    return vec4[](0.25 * inner, 0.25 * (a + b + d + e), 0.25 * (b + c + e + f),
                  0.25 * (d + e + g + h), 0.25 * (e + f + h + i));
}
