// Adds up an image of sums, and one of squares below it, as lib/sums.glsl does.

SAMPLED_IMAGE(SLOT_SOURCE, source);

#define STACKED 2
#define STACKED_HEIGHT ((summed_size().y + SUM_SIDE - 1) / SUM_SIDE)

ivec2 summed_size()
{
    return textureSize(source, 0) / ivec2(1, STACKED);
}

#include "lib/fullscreen.glsl"

void start() {}

vec4 shade()
{
    ivec2 size = summed_size(), apart = (size + SUM_SIDE - 1) / SUM_SIDE, first = PIXEL;
    vec4 sum = vec4(0.0);
    for (int y = first.y; y < size.y; y += apart.y) {
        vec4 row = vec4(0.0);
        // Without a condition for each load they are all under way together.
        [[unroll]] for (int i = 0; i < SUM_SIDE; ++i) {
            int x = first.x + i * apart.x;
            vec4 texel = texelFetch(source, ivec2(min(x, size.x - 1), y + picture * size.y), 0);
            row += x < size.x ? texel : vec4(0.0);
        }
        sum += row;
    }
    return sum;
}
