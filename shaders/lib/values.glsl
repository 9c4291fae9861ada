// The sums of values at the pixels of a pass's cotangents (lib/sums.glsl). The including shader defines values(), those of
// PIXEL.
vec4 values();

#include "lib/sums.glsl"

ivec2 summed_size()
{
    return textureSize(cotangents, 0);
}

void add_pixel(inout vec4 sum, inout vec4 squares)
{
    vec4 added = values();
    sum += added;
    squares += added * added;
}
