#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The first passes of published methods, whose taps are among 4 x 4 texels of an image of exactly twice the
// target's size (EXACT_HALF), or of its size. Without it `filament` takes 62 ms in place of 45, `unity_hdrp`
// 86 in place of 67, `kino` 184 in place of 86 (processor time of 1920 x 1080 in float16, lavapipe of Mesa
// 25.0.7, 2026-11-26).
#include "lib/block.glsl"
#include "lib/sampling.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"
#include "lib/prefilters.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = PREFILTER_COLUMNS(CHANNEL_BYTES), ROWS = TEXEL_ROWS;
const int LOADED = 2 * COLUMNS + 2;
// A pixel's position in the source: a texel, and what is after it. The texels BEFORE it to 2 after it are
// loaded; the compiler removes those that no tap needs.
const int BEFORE = 1, SIDE = 4, RATIO = EXACT == EXACT_HALF ? 2 : 1;
const float PART = EXACT == EXACT_HALF ? 0.5 : 0.0;

#define LOAD_FROM (-BEFORE)
#include "variants/runs.glsl"

vec4 texels[SIDE][LOADED];

void load_row(int x, int y, int row)
{
    uvec4 raw[LOADED];

    load_run(RATIO * x, clamp(y, 0, read_shapes[0].y - 1), raw);
    [[unroll]] for (int i = 0; i < LOADED; ++i)
        texels[row][i] = value_of(FROM_IMAGE != 0 ? finite_bits(raw[i]) : raw[i]);
}

// A bilinear tap of the pixel in this column, at an offset from its position.
vec4 tap(int column, vec2 offset)
{
    vec2 moved = offset + PART, integer = floor(moved), part = moved - integer;
    int x = RATIO * column + BEFORE + int(integer.x), y = BEFORE + int(integer.y);
    if (part == vec2(0.0))
        return texels[y][x];
    return bilinear(vec4[](texels[y][x], texels[y][x + 1], texels[y + 1][x], texels[y + 1][x + 1]),
                    part);
}

vec4 prefiltered(int column)
{
    FilamentTaps pairs = filament_taps(vec2(PART));
    vec4 found[5] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
    [[unroll]] for (int group = 0; group < 5; ++group)
        if (group < group_count())
            found[group] = tap(column, place_of(group, pairs));
    return made(found, pairs.shares);
}

void write_row(int x, int y)
{
    uvec4 pixels[COLUMNS];

    [[unroll]] for (int row = 0; row < SIDE; ++row)
        load_row(x, RATIO * y - BEFORE + row, row);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        pixels[i] = buffer_of(prefiltered(i));
    store(x, y, pixels);
}

#include "variants/rows.glsl"
