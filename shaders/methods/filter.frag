// A filter of an image of any size (lib/filter.glsl), and the share of an image of the target's size.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_SAME_SIZE, same_size);

#include "lib/fullscreen.glsl"
#include "lib/filter.glsl"
#include "lib/filter_image.glsl"

vec4 shade()
{
    vec4 sum = params.coarse * (filtered(source) / params.divisor);
    if (ADDS_IMAGE != 0)
        sum += params.same_size * texelFetch(same_size, PIXEL, 0);
    return stored(sum);
}
