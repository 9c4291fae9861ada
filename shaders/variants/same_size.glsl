// A pass that makes each pixel from the one at its position. Define `vec4 made(vec4 value)` and
// include variants/pixels.glsl before this file.

const int COLUMNS = TEXEL_COLUMNS(CHANNEL_BYTES), LOADED = COLUMNS;
#define LOADED_FROM 0
#include "variants/runs.glsl"

void main()
{
    read_words();
    ivec2 size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(COLUMNS, TEXEL_ROWS));
    int end = min(first.y + TEXEL_ROWS, size.y);
    uvec4 raw[COLUMNS];

    if (first.x >= size.x)
        return;
    for (int y = first.y; y < end; ++y) {
        load_run(first.x, y, raw);
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            raw[i] = buffer_of(made(value_of(raw[i])));
        store(first.x, y, raw);
    }
}
