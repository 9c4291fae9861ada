// Adds up an image of sums, and one of squares below it.

SAMPLED_IMAGE(SLOT_SOURCE, source);

#include "lib/sums.glsl"

ivec2 summed_size()
{
    return textureSize(source, 0) / ivec2(1, 2);
}

void add_pixel(inout vec4 sum, inout vec4 squares)
{
    sum += texelFetch(source, PIXEL, 0);
    squares += texelFetch(source, PIXEL + ivec2(0, summed_size().y), 0);
}
