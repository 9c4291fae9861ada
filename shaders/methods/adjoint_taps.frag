// Of a blur along one axis between images of one size, the sums by three of its weights, and by a factor of the distances
// of the taps with these: what they sample, and how it changes, times cotangents of the other axis. Two taps, at opposite
// distances, have in place of a weight: the distance in whole texels, the rest, and a factor of the change. The last
// number is 1 where the taps are on texels' centres: the change is that between the texels on both sides then.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#include "lib/values.glsl"
#include "lib/target_cotangents.glsl"

vec4 texels_at(int distance)
{
    ivec2 apart = DIRECTION == DIRECTION_VERTICAL ? ivec2(0, distance) : ivec2(distance, 0);
    return fetch_clamped(source, PIXEL + apart) + fetch_clamped(source, PIXEL - apart);
}

vec4 values()
{
    vec4 cotangent = cotangent_of_target(), products = vec4(0.0);
    // What it would be multiplied by may be infinite.
    if (cotangent == vec4(0.0))
        return products;
    for (int i = 0; i < 3; ++i) {
        int tap = FIRST_SAMPLE + i;
        if (tap > RADIUS)
            continue;
        if (tap == 0) {
            products[i] = dot(cotangent, fetch_clamped(source, PIXEL));
            continue;
        }
        vec4 numbers = params.weights[tap];
        int whole = int(numbers.x);
        vec4 nearer = texels_at(whole), further = texels_at(whole + 1), before = nearer;
        if (numbers.w != 0.0)
            before = texels_at(whole - 1);
        products[i] = dot(cotangent, mix(nearer, further, numbers.y));
        products.w += numbers.z * dot(cotangent, further - before);
    }
    return products;
}
