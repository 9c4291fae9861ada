#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// Downsampling to exactly half the size with bilinear taps in three rows and columns: dual Kawase's,
// and Filament's. The middle ones are between the two texels of the pixel, the outer ones between
// those of the next pixel (NEXT_PIXEL) or between the same two. An invocation writes a strip
// from top to bottom and has the taps of each pair of rows once.
#include "lib/block.glsl"
#include "lib/filament.glsl"
#include "lib/finite.glsl"
#include "lib/sampling.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(KAWASE_BLOCK);
#include "lib/storage.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = GRID_COLUMNS, LOADED = 2 * COLUMNS + 4, AXIS = 3;

#define LOAD_FROM -2
#include "variants/runs.glsl"

#include "variants/thresholded.glsl"

float parts[AXIS];

void load_taps(int x, int y, out vec4 taps[COLUMNS][AXIS])
{
    uvec4 raw[LOADED];
    vec4 texels[LOADED];

    load_run(x, clamp(y, 0, read_shapes[0].y - 1), raw);
    [[unroll]] for (int i = 0; i < LOADED; ++i)
        texels[i] = thresholded(value_of(raw[i]));
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        [[unroll]] for (int tap = 0; tap < AXIS; ++tap) {
            int at = 2 * (i + 1 + NEXT_PIXEL * (tap - 1));
            taps[i][tap] = blended(texels[at], texels[at + 1], parts[tap]);
        }
}

// `taps` are in three rows of three.
vec4 combined(vec4 taps[AXIS][AXIS])
{
    if (GROUPS == GROUPS_FILAMENT) {
        vec4 sum = vec4(0.0);
        [[unroll]] for (int y = 0; y < AXIS; ++y)
            [[unroll]] for (int x = 0; x < AXIS; ++x)
                sum += FILAMENT_SHARES[x] * FILAMENT_SHARES[y] * taps[y][x];
        return sum;
    }
    return (4.0 * taps[1][1] + taps[2][2] + taps[0][2] + taps[2][0] + taps[0][0]) / 8.0;
}

void main()
{
    read_words();
    ivec2 size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(COLUMNS, HALVE_WORDS_ROWS));
    int end = min(first.y + HALVE_WORDS_ROWS, size.y);
    float distance = 0.5 * params.offset;
    // The upper taps of the last two pairs of rows, and the middle ones of the last pair.
    vec4 upper[2][COLUMNS][AXIS], middle[COLUMNS][AXIS];
    uvec4 pixels[COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    parts[0] = (0.5 - distance) + 2.0 * float(NEXT_PIXEL);
    parts[1] = 0.5;
    parts[2] = (0.5 + distance) - 2.0 * float(NEXT_PIXEL);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        [[unroll]] for (int x = 0; x < AXIS; ++x)
            upper[0][i][x] = upper[1][i][x] = middle[i][x] = vec4(0.0);
    for (int y = first.y - NEXT_PIXEL; y < end + NEXT_PIXEL; ++y) {
        vec4 even[COLUMNS][AXIS], odd[COLUMNS][AXIS];
        load_taps(2 * first.x, 2 * y, even);
        load_taps(2 * first.x, 2 * y + 1, odd);
        [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
            vec4 taps[AXIS][AXIS];
            [[unroll]] for (int x = 0; x < AXIS; ++x) {
                vec4 highest = blended(even[i][x], odd[i][x], parts[0]);
                vec4 central = blended(even[i][x], odd[i][x], parts[1]);
                taps[0][x] = NEXT_PIXEL == 0 ? highest : upper[0][i][x];
                taps[1][x] = NEXT_PIXEL == 0 ? central : middle[i][x];
                taps[2][x] = blended(even[i][x], odd[i][x], parts[2]);
                upper[0][i][x] = upper[1][i][x];
                upper[1][i][x] = highest;
                middle[i][x] = central;
            }
            pixels[i] = buffer_of(combined(taps));
        }
        if (y >= first.y + NEXT_PIXEL)
            store(first.x, y - NEXT_PIXEL, pixels);
    }
}
