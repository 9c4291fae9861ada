// A pass that adds up values over the pixels of its cotangents, always in the same order, and their squares, a second
// picture below that of the sums (fullscreen.glsl). A pixel of both has those at distances of their size, SUM_SIDE x
// SUM_SIDE at most. So neighbouring invocations read neighbouring pixels. The including shader defines summed(), the
// values of PIXEL. adjoint_sum.frag adds up what the pass writes.
vec4 summed();

#define STACKED 2
#define STACKED_HEIGHT ((textureSize(cotangents, 0).y + SUM_SIDE - 1) / SUM_SIDE)
#include "lib/fullscreen.glsl"

ivec2 pixel;
vec4 sums[STACKED];

void start()
{
    ivec2 size = textureSize(cotangents, 0), apart = (size + SUM_SIDE - 1) / SUM_SIDE, first = PIXEL;
    sums[0] = sums[1] = vec4(0.0);
    for (int y = first.y; y < size.y; y += apart.y) {
        vec4 row = vec4(0.0), squares = vec4(0.0);
        for (int x = first.x; x < size.x; x += apart.x) {
            pixel = ivec2(x, y);
            vec4 values = summed();
            row += values;
            squares += values * values;
        }
        sums[0] += row;
        sums[1] += squares;
    }
}

vec4 shade()
{
    return sums[picture];
}

#undef PIXEL
#define PIXEL pixel
