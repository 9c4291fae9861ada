// Samples an image with a cubic B-spline whose control points are the texels.

vec4 cubic_weights(float part)
{
    float rest = 1.0 - part;
    return vec4(rest * rest * rest, 4.0 - 3.0 * part * part * (2.0 - part),
                4.0 - 3.0 * rest * rest * (2.0 - rest), part * part * part) / 6.0;
}

vec3 sample_cubic(sampler2D image, Place place)
{
    vec4 across = cubic_weights(place.part.x);
    vec4 down = cubic_weights(place.part.y);
    vec3 sum = vec3(0.0);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
            ivec2 texel = place.texel + ivec2(x - 1, y - 1);
            sum += across[x] * down[y] * fetch_clamped(image, texel).rgb;
        }
    return sum;
}
