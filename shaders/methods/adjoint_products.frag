// The sums of the products of an image and its cotangents, for each channel: the derivatives by factors of the channels,
// times these.
SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#include "lib/values.glsl"
#include "lib/target_cotangents.glsl"

vec4 values()
{
    vec4 cotangent = cotangent_of_target();
    // What it would be multiplied by may be infinite.
    return mix(vec4(0.0), cotangent * texelFetch(source, PIXEL, 0), notEqual(cotangent, vec4(0.0)));
}
