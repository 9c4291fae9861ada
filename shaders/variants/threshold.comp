// The threshold pass if the bloom buffers have the size of the image. As a fragment shader it takes 23 ms in place of 7,
// with Mesa 25.0.7 30 in place of 6 (processor time of a call, 1920 x 1080 in float16, lavapipe of Mesa 22.3.6,
// 2026-11-28).

UNIFORM_BLOCK(THRESHOLD_BLOCK);
#include "variants/pixels.glsl"

const int COLUMNS = TEXEL_COLUMNS(CHANNEL_BYTES), ROWS = TEXEL_ROWS, LOADED = COLUMNS;
#define LOAD_CHANNELS SOURCE_CHANNELS
#include "variants/runs.glsl"

void write_row(int x, int y)
{
    uvec4 raw[COLUMNS];

    load_run(x, y, raw);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec4 value = finite_or_zero(value_of(raw[i]));
        raw[i] = buffer_of(apply_threshold(value, THRESHOLD_MODE, params.threshold, params.knee));
    }
    store(x, y, raw);
}

#include "variants/rows.glsl"
