#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Downsampling to exactly half the size with taps that are weighted by brightness. The taps are means
// of 2 x 2 texels: the outer ones of pairs of rows and columns that begin at even texels, the inner
// ones of pairs that begin at odd texels. An invocation writes a strip from top to bottom, loads each
// texel once, and has each tap for all pixels that share it. Without it `pygfx` takes 122 ms in place
// of 57, `blender_bloom` 172 in place of 106, `kino` 109 in place of 86 (processor time of 1920 x
// 1080 in float16, lavapipe of Mesa 25.0.7, 2026-11-26).
#include "lib/block.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"
#include "lib/groups.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = HALVE_LINEAR_COLUMNS, ROWS = HALVE_LINEAR_ROWS;
const int LOADED = 2 * COLUMNS + 4;
const int OUTER = COLUMNS + 2, INNER = COLUMNS + 1;

#define LOAD_FROM -2
#include "variants/runs.glsl"

vec4 middle(vec4 a, vec4 b)
{
    return 0.5 * a + 0.5 * b;
}

void main()
{
    copy_shapes();
    ivec2 source_size = READ_SIZE(source, 1), size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(COLUMNS, ROWS));
    int end = min(first.y + ROWS, size.y);
    // Outer taps of three pairs of rows, inner ones of two. `odd` is the second row of the last pair.
    vec4 outer[3][OUTER], inner[2][INNER], odd[INNER];
    uvec4 raw[LOADED], pixels[COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    [[unroll]] for (int i = 0; i < OUTER; ++i)
        outer[1][i] = outer[2][i] = vec4(0.0);
    [[unroll]] for (int i = 0; i < INNER; ++i)
        inner[1][i] = odd[i] = vec4(0.0);
    for (int y = first.y - 1; y <= end; ++y) {
        vec4 even_row[OUTER], odd_row[OUTER];
        [[unroll]] for (int i = 0; i < OUTER; ++i) {
            outer[0][i] = outer[1][i];
            outer[1][i] = outer[2][i];
        }
        load_run(2 * first.x, clamp(2 * y, 0, source_size.y - 1), raw);
        [[unroll]] for (int i = 0; i < OUTER; ++i)
            even_row[i] = middle(value_of(raw[2 * i]), value_of(raw[2 * i + 1]));
        [[unroll]] for (int i = 0; i < INNER; ++i) {
            vec4 row = middle(value_of(raw[2 * i + 1]), value_of(raw[2 * i + 2]));
            inner[0][i] = inner[1][i];
            inner[1][i] = middle(odd[i], row);
        }
        load_run(2 * first.x, clamp(2 * y + 1, 0, source_size.y - 1), raw);
        [[unroll]] for (int i = 0; i < OUTER; ++i) {
            odd_row[i] = middle(value_of(raw[2 * i]), value_of(raw[2 * i + 1]));
            outer[2][i] = middle(even_row[i], odd_row[i]);
        }
        [[unroll]] for (int i = 0; i < INNER; ++i)
            odd[i] = middle(value_of(raw[2 * i + 1]), value_of(raw[2 * i + 2]));
        if (y <= first.y)
            continue;
        [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
            Taps taps;
            [[unroll]] for (int row = 0; row < 3; ++row)
                [[unroll]] for (int column = 0; column < 3; ++column)
                    taps.outer[3 * row + column] = outer[row][i + column];
            [[unroll]] for (int row = 0; row < 2; ++row)
                [[unroll]] for (int column = 0; column < 2; ++column)
                    taps.inner[2 * row + column] = inner[row][i + column];
            pixels[i] = buffer_of(combined(taps));
        }
        store(first.x, y - 1, pixels);
    }
}
