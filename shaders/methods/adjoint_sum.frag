// Adds up an image of sums and one of sums of squares.

SAMPLED_IMAGE(SLOT_SOURCE, sums);
SAMPLED_IMAGE(SLOT_SQUARES, sums_of_squares);

#include "lib/sums.glsl"

ivec2 summed_size()
{
    return textureSize(sums, 0);
}

void add_pixel(inout vec4 sum, inout vec4 squares)
{
    sum += texelFetch(sums, PIXEL, 0);
    squares += texelFetch(sums_of_squares, PIXEL, 0);
}
