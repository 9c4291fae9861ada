// HDRP's vertical blur of an image of the target's size (FIRST_LEVEL) or of exactly twice its height, whose
// samples are means of two texels. An invocation writes one word of some rows, and has each sample
// once for all of them.

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/nine.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = 4 / CHANNEL_BYTES, ROWS = NINE_OUTPUTS;  // COLUMNS: of a word
const int LOADED = COLUMNS;

#include "variants/runs.glsl"

void take_sample(int x, int y, out vec4 taken[COLUMNS])
{
    uvec4 raw[COLUMNS], next[COLUMNS];
    bool before = y < 0;
    int row = min(y, target_shape.y - 1);

    row = before ? (FIRST_LEVEL != 0 ? y & 1 : 0) : FIRST_LEVEL != 0 ? row : 2 * row;
    load_run(x, min(row, read_shapes[SLOT_SOURCE].y - 1), raw);
    if (FIRST_LEVEL == 0)
        load_run(x, before ? 0 : row + 1, next);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        taken[i] = FIRST_LEVEL != 0 ? value_of(raw[i]) : 0.5 * value_of(raw[i]) + 0.5 * value_of(next[i]);
}

void write_block(ivec2 first, int end)
{
    vec4 sums[ROWS][COLUMNS];

    [[unroll]] for (int row = 0; row < ROWS; ++row)
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            sums[row][i] = vec4(0.0);
    [[unroll]] for (int at = 0; at < ROWS + 2 * NINE_RADIUS; ++at) {
        vec4 taken[COLUMNS];
        take_sample(first.x, first.y - NINE_RADIUS + at, taken);
        [[unroll]] for (int row = 0; row < ROWS; ++row)
            if (row <= at && at <= row + 2 * NINE_RADIUS)
                [[unroll]] for (int i = 0; i < COLUMNS; ++i)
                    sums[row][i] += nine_weight(at - row - NINE_RADIUS) * taken[i];
    }
    [[unroll]] for (int row = 0; row < ROWS; ++row) {
        uvec4 pixels[COLUMNS];
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            pixels[i] = buffer_of(sums[row][i]);
        if (first.y + row < end)
            store(first.x, first.y + row, pixels);
    }
}

#include "variants/blocks.glsl"
