#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// KinoBloom's prefilter, which reads an image of the size of its target. Without it
// `kino` takes 184 ms in place of 86 (processor time of 1920 x
// 1080 in float16, lavapipe of Mesa 25.0.7, 2026-11-26).
#include "lib/block.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"
#include "lib/kino.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = TEXEL_COLUMNS(CHANNEL_BYTES), ROWS = TEXEL_ROWS;

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, image);
WRITE_IMAGE(2);

#define LOAD load_run
#define LOAD_IMAGE image
#define LOAD_NUMBER 1
#include "variants/load.glsl"

#define LOAD load_wide
#define LOAD_IMAGE image
#define LOAD_NUMBER 1
#define LOAD_FROM -1
#define LOAD_COUNT (COLUMNS + 2)
#include "variants/load.glsl"

#define STORE_COUNT COLUMNS
#include "variants/store.glsl"

void write_row(int x, int y)
{
    uvec4 raw[COLUMNS + 2], up[COLUMNS], down[COLUMNS], pixels[COLUMNS];

    load_wide(x, y, raw);
    load_run(x, max(y - 1, 0), up);
    load_run(x, min(y + 1, target_shape.y - 1), down);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        pixels[i] = buffer_of(kino_bright(value_of(raw[i + 1]), value_of(raw[i]),
                                          value_of(raw[i + 2]), value_of(up[i]),
                                          value_of(down[i])));
    store(x, y, pixels);
}

#include "variants/rows.glsl"
