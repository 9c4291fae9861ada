// Samples an image with a cubic B-spline whose control points are the texels.

vec4 cubic_weights(float part)
{
    float rest = 1.0 - part;
    return vec4(rest * rest * rest, 4.0 - 3.0 * part * part * (2.0 - part),
                4.0 - 3.0 * rest * rest * (2.0 - rest), part * part * part) / 6.0;
}

vec4 sample_cubic(sampler2D image, Place place)
{
    vec4 weights_x = cubic_weights(place.part.x);
    vec4 weights_y = cubic_weights(place.part.y);
    vec4 sum = vec4(0.0);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
            ivec2 texel = place.texel + ivec2(x - 1, y - 1);
            sum += weights_x[x] * weights_y[y] * fetch_clamped(image, texel);
        }
    return sum;
}

// The same as two bilinear taps along each axis, none of them further from the place's texel than
// `furthest` (Sigg and Hadwiger, "Fast Third-Order Texture Filtering", GPU Gems 2, chapter 20).
vec4 sample_cubic_within(sampler2D image, Place place, vec2 furthest, int sampling)
{
    vec4 weights_x = cubic_weights(place.part.x);
    vec4 weights_y = cubic_weights(place.part.y);
    vec2 left = vec2(weights_x.x + weights_x.y, weights_y.x + weights_y.y);
    vec2 right = vec2(weights_x.z + weights_x.w, weights_y.z + weights_y.w);
    vec2 near = min(vec2(weights_x.y, weights_y.y) / left - 1.0, furthest);
    vec2 far = min(vec2(weights_x.w, weights_y.w) / right + 1.0, furthest);
    Place texel = Place(place.texel, vec2(0.0));
    return left.y * (left.x * sample_at(image, texel, near, sampling)
                     + right.x * sample_at(image, texel, vec2(far.x, near.y), sampling))
         + right.y * (left.x * sample_at(image, texel, vec2(near.x, far.y), sampling)
                      + right.x * sample_at(image, texel, far, sampling));
}
