// A filter of an image of any size (lib/filter.glsl), and the share of an image of the target's size.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 2) uniform sampler2D own;

#include "lib/fullscreen.glsl"
#include "lib/filter.glsl"
#include "lib/filter_image.glsl"

vec4 shade()
{
    vec4 sum = params.coarse * (filtered(source) / params.divisor);
    if (ADD_OWN != 0)
        sum += params.own * texelFetch(own, PIXEL, 0);
    return stored(sum);
}
