#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// KinoBloom's prefilter, which reads an image of the size of its target.
#include "lib/block.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(PREFILTER_BLOCK);
#include "lib/storage.glsl"
#include "lib/kino.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = TEXEL_COLUMNS(CHANNEL_BYTES);

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, image);
WRITE_IMAGE(2);

#define LOAD load_run
#define LOAD_IMAGE image
#define LOAD_NUMBER 1
#define LOAD_CHANNELS 4
#define LOAD_FROM 0
#define LOAD_COUNT COLUMNS
#include "variants/load.glsl"

#define LOAD load_wide
#define LOAD_IMAGE image
#define LOAD_NUMBER 1
#define LOAD_CHANNELS 4
#define LOAD_FROM -1
#define LOAD_COUNT (COLUMNS + 2)
#include "variants/load.glsl"

#define STORE_COUNT COLUMNS
#include "variants/store.glsl"

void main()
{
    read_words();
    ivec2 size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(COLUMNS, TEXEL_ROWS));
    int end = min(first.y + TEXEL_ROWS, size.y);
    uvec4 raw[COLUMNS + 2], up[COLUMNS], down[COLUMNS], pixels[COLUMNS];

    if (first.x >= size.x)
        return;
    for (int y = first.y; y < end; ++y) {
        load_wide(first.x, y, raw);
        load_run(first.x, max(y - 1, 0), up);
        load_run(first.x, min(y + 1, size.y - 1), down);
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            pixels[i] = buffer_of(kino_bright(value_of(raw[i + 1]), value_of(raw[i]),
                                              value_of(raw[i + 2]), value_of(up[i]),
                                              value_of(down[i])));
        store(first.x, y, pixels);
    }
}
