// The complete bloom of an image for devices without fast shared memory.
#include "variants/fused_bloom.glsl"
#include "variants/pixels.glsl"

#define STRIP_CHANNELS SOURCE_CHANNELS
#define ENDED_BINDING 2
#include "lib/ended.glsl"
#include "variants/strip.glsl"

float weights[STRIP_RADIUS + 1], row_weights[STRIP_RADIUS + 1];

void start_weights(ivec2 first, ivec2 size)
{
    [[unroll]] for (int i = 0; i <= STRIP_RADIUS; ++i) {
        weights[i] = vertical_weight(i);
        row_weights[i] = horizontal_weight(i);
    }
}

float row_weight(int row, int tap)
{
    return weights[abs(STRIP_RADIUS - tap)];
}

float column_weight(int column, int tap)
{
    return row_weights[abs(STRIP_RADIUS - tap)];
}

void start_columns(int x, int width)
{
}

void change_run(int loaded, int at, inout uvec4 run[RUN_WORDS])
{
}

vec3 added_of(uvec4 raw)
{
    return thresholded(value_of(raw).rgb);
}

vec3 kept_of(vec3 sum)
{
    return as_stored(sum, FORMAT);
}

// Replaces sums outside of the image by those of its outermost columns.
void end_columns(int x, int at, int width, inout vec3 sums[ROWS][COLUMNS])
{
    [[unroll]] for (int row = 0; row < ROWS; ++row) {
        [[unroll]] for (int i = 1; i < COLUMNS; ++i)
            sums[row][i] = at * COLUMNS + i >= width ? sums[row][i - 1] : sums[row][i];
        [[unroll]] for (int i = 0; i < COLUMNS - 1; ++i)
            sums[row][i] = x > at * COLUMNS ? sums[row][COLUMNS - 1] : sums[row][i];
        [[unroll]] for (int i = 1; i < COLUMNS; ++i)
            sums[row][i] = x < 0 ? sums[row][0] : sums[row][i];
    }
}

uvec4 finished_pixel(uvec4 raw, vec3 sum, ivec2 pixel)
{
    return ended(raw, vec4(as_stored(sum, FORMAT), 1.0), pixel);
}
