// A pass that makes each pixel from the one at its position. Define `vec4 made(vec4 value)` and
// include variants/pixels.glsl before this file.

const int COLUMNS = TEXEL_COLUMNS(CHANNEL_BYTES), ROWS = TEXEL_ROWS, LOADED = COLUMNS;
#include "variants/runs.glsl"

void write_row(int x, int y)
{
    uvec4 raw[COLUMNS];

    load_run(x, y, raw);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        raw[i] = buffer_of(made(value_of(raw[i])));
    store(x, y, raw);
}

#include "variants/rows.glsl"
