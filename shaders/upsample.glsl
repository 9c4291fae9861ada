// The filters by which a smaller level is read between its texels. A shader that includes this has
// SAMPLING and UPSAMPLE, and steps of the tent in its parameters.

// 3 x 3 taps of weights (1 2 1)^2 / 16.
vec3 upsample_tent(sampler2D image, vec2 position)
{
    vec3 sum = vec3(0.0);
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
            vec2 offset = vec2(params.step_x, params.step_y) * vec2(x, y);
            float weight = (2.0 - abs(float(x))) * (2.0 - abs(float(y))) / 16.0;
            sum += weight * sample_at(image, position + offset, SAMPLING).rgb;
        }
    return sum;
}

vec4 cubic_weights(float part)
{
    float rest = 1.0 - part;
    return vec4(rest * rest * rest, 4.0 - 3.0 * part * part * (2.0 - part),
                4.0 - 3.0 * rest * rest * (2.0 - rest), part * part * part) / 6.0;
}

// The cubic B-spline through 4 x 4 texels.
vec3 upsample_cubic(sampler2D image, vec2 position)
{
    vec2 base = floor(position - 0.5);
    vec4 across = cubic_weights(position.x - 0.5 - base.x);
    vec4 down = cubic_weights(position.y - 0.5 - base.y);
    vec3 sum = vec3(0.0);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
            ivec2 texel = ivec2(base) + ivec2(x - 1, y - 1);
            sum += across[x] * down[y] * fetch_clamped(image, texel).rgb;
        }
    return sum;
}

vec3 upsample(sampler2D image, vec2 position)
{
    if (UPSAMPLE == UPSAMPLE_LINEAR)
        return sample_at(image, position, SAMPLING).rgb;
    if (UPSAMPLE == UPSAMPLE_CUBIC)
        return upsample_cubic(image, position);
    return upsample_tent(image, position);
}
