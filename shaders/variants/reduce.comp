#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The first passes of published methods that read an image of exactly twice the target's size, with
// bilinear taps among 4 x 4 texels. An invocation writes a strip from top to bottom and loads each
// texel once. Without it `filament` takes 62 ms in place of 45, `unity_hdrp` 86 in place of 67 (processor time of 1920 x
// 1080 in float16, lavapipe of Mesa 25.0.7, 2026-11-26).
#include "lib/block.glsl"
#include "lib/sampling.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"
#include "lib/prefilters.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = REDUCE_COLUMNS, ROWS = HALVE_WORDS_ROWS;
const int LOADED = 2 * COLUMNS + 2;
// A pixel of the target has the texels BEFORE before twice its own position to 2 after it.
const int BEFORE = 1, SIDE = 4;

#define LOAD_FROM (-BEFORE)
#include "variants/runs.glsl"

vec4 texels[SIDE][LOADED];

void load_row(int x, int y, int row)
{
    uvec4 raw[LOADED];

    load_run(2 * x, clamp(y, 0, read_shapes[0].y - 1), raw);
    [[unroll]] for (int i = 0; i < LOADED; ++i)
        texels[row][i] = value_of(FROM_IMAGE != 0 ? finite_bits(raw[i]) : raw[i]);
}

// A bilinear tap of the pixel in this column, at an offset from the middle of its 2 x 2 texels.
vec4 tap(int column, vec2 offset)
{
    vec2 moved = offset + 0.5, integer = floor(moved), part = moved - integer;
    int x = 2 * column + BEFORE + int(integer.x), y = BEFORE + int(integer.y);
    return bilinear(vec4[](texels[y][x], texels[y][x + 1], texels[y + 1][x], texels[y + 1][x + 1]),
                    part);
}

vec4 prefiltered(int column)
{
    if (GROUPS == GROUPS_FILAMENT) {
        vec4 taps[4] = vec4[](tap(column, vec2(-0.75, -0.75)), tap(column, vec2(0.75, -0.75)),
                              tap(column, vec2(-0.75, 0.75)), tap(column, vec2(0.75, 0.75)));
        return filament_prefiltered(taps, vec4(0.25));
    }
    if (GROUPS == GROUPS_HDRP) {
        vec4 taps[5];
        [[unroll]] for (int i = 0; i < 5; ++i)
            taps[i] = tap(column, HDRP_OFFSETS[i]);
        return hdrp_prefiltered(taps);
    }
    vec4 value = tap(column, vec2(0.0));
    return GROUPS == GROUPS_URP ? unity_prefiltered(value) : three_prefiltered(value);
}

void write_row(int x, int y)
{
    uvec4 pixels[COLUMNS];

    [[unroll]] for (int row = 0; row < SIDE; ++row)
        load_row(x, 2 * y - BEFORE + row, row);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        pixels[i] = buffer_of(prefiltered(i));
    store(x, y, pixels);
}

#include "variants/rows.glsl"
