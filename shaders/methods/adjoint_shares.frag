// Of a sum of a level and a smaller one, whose shares settings can change: the sums of the products of its cotangents
// with the level, and with the sum itself.
SAMPLED_IMAGE(SLOT_SOURCE, sum);
SAMPLED_IMAGE(SLOT_SAME_SIZE, level);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#include "lib/values.glsl"
#include "lib/target_cotangents.glsl"

vec4 values()
{
    vec4 cotangent = cotangent_of_target();
    return vec4(dot(cotangent, texelFetch(level, PIXEL, 0)), dot(cotangent, texelFetch(sum, PIXEL, 0)), 0.0, 0.0);
}
