// Of a sum of a level and a smaller one, whose shares settings can change: the sums of the products of its cotangents
// with the level, and with the sum itself; of colours, then of alpha.
SAMPLED_IMAGE(SLOT_SOURCE, sum);
SAMPLED_IMAGE(SLOT_SAME_SIZE, level);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#include "lib/values.glsl"

vec4 values()
{
    vec4 cotangent = texelFetch(cotangents, PIXEL, 0);
    vec4 by_level = cotangent * texelFetch(level, PIXEL, 0), by_sum = cotangent * texelFetch(sum, PIXEL, 0);
    return vec4(dot(by_level.rgb, vec3(1.0)), dot(by_sum.rgb, vec3(1.0)), by_level.a, by_sum.a);
}
