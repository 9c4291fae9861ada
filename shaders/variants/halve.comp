#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#pragma compile images
// Downsampling in the pyramid to exactly half the size. The 13 taps are between texels, so they are
// the sum of two separable kernels, (1 1 1 1) / 4 and (1 1 2 2 1 1) / 8 along each axis, each with
// half of the weight. An invocation writes a strip from top to bottom and loads each texel once.
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);
#include "lib/storage.glsl"
#include "variants/pixels.glsl"

#ifdef LINEAR_TEXELS
const int COLUMNS = HALVE_LINEAR_COLUMNS, ROWS = HALVE_LINEAR_ROWS;
#else
const int COLUMNS = HALVE_COLUMNS, ROWS = HALVE_ROWS;
#define INVOCATIONS HALVE_INVOCATIONS
#endif
const int LOADED = 2 * COLUMNS + 4;

#define LOAD_FROM -2
#include "variants/runs.glsl"

#include "variants/thresholded.glsl"

void main()
{
    copy_shapes();
    ivec2 source_size = READ_SIZE(source, 1), size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(COLUMNS, ROWS));
    int end = min(first.y + ROWS, size.y);
    // The sums of three output rows: a pair of source rows is the end of the first, the middle of
    // the second and the start of the third.
    vec4 ending[COLUMNS], middle[COLUMNS], starting[COLUMNS];
    vec4 texels[LOADED];
    uvec4 raw[LOADED], stored[COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        ending[i] = middle[i] = vec4(0.0);
    for (int y = first.y - 1; y <= end; ++y) {
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            starting[i] = vec4(0.0);
        [[unroll]] for (int half_row = 0; half_row < 2; ++half_row) {
            load_run(2 * first.x, clamp(2 * y + half_row, 0, source_size.y - 1), raw);
            [[unroll]] for (int i = 0; i < LOADED; ++i)
                texels[i] = thresholded(value_of(raw[i]));
            [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
                vec4 inner = texels[2 * i + 2] + texels[2 * i + 3];
                vec4 four = inner + texels[2 * i + 1] + texels[2 * i + 4];
                vec4 six = four + inner + texels[2 * i] + texels[2 * i + 5];
                // The weights are 1/2 * 1/4 * 1/4 and 1/2 * 1/8 * 1/8 (the two middle rows have
                // twice that).
                ending[i] += six / 128.0 + (half_row == 0 ? four / 32.0 : vec4(0.0));
                middle[i] += six / 64.0 + four / 32.0;
                starting[i] += six / 128.0 + (half_row == 1 ? four / 32.0 : vec4(0.0));
            }
        }
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            stored[i] = buffer_of(ending[i]);
        if (y > first.y)
            store(first.x, y - 1, stored);
        [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
            ending[i] = middle[i];
            middle[i] = starting[i];
        }
    }
}
