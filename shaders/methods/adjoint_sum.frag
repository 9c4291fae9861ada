// Adds up the pixels of an image, or their squares, in blocks of SUM_SIDE x SUM_SIDE, always in the same order.

SAMPLED_IMAGE(SLOT_SOURCE, source);

#include "lib/fullscreen.glsl"

vec4 shade()
{
    ivec2 first = PIXEL * SUM_SIDE, end = min(first + SUM_SIDE, textureSize(source, 0));
    vec4 sum = vec4(0.0);
    for (int y = first.y; y < end.y; ++y) {
        vec4 row = vec4(0.0);
        for (int x = first.x; x < end.x; ++x) {
            vec4 value = texelFetch(source, ivec2(x, y), 0);
            row += SQUARED != 0 ? value * value : value;
        }
        sum += row;
    }
    return sum;
}
