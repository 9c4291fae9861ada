// Adds up the sums of adjoint_weights.frag at each place of a grid: those of the interval after it, as the place before
// the pixels, and those of the interval before it, as the next one.
UNIFORM_BLOCK(NODE_SUMS_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);

#include "lib/fullscreen.glsl"

vec4 shade()
{
    const bool vertical = DIRECTION == DIRECTION_VERTICAL;
    int node = vertical ? PIXEL.y : PIXEL.x;
    vec4 result = vec4(0.0);
    for (int next = 0; next < 2; ++next) {
        int cell = node - next, below = next * params.lines;
        if (cell < 0 || cell >= params.cells)
            continue;
        for (int i = cell * params.parts; i < (cell + 1) * params.parts; ++i)
            result += texelFetch(source, vertical ? ivec2(PIXEL.x, below + i) : ivec2(i, below + PIXEL.y), 0);
    }
    return result;
}
