#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The threshold pass if the bloom buffers have the size of the image.
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(THRESHOLD_BLOCK);
#include "lib/storage.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = TEXEL_COLUMNS(CHANNEL_BYTES);

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, image);
WRITE_IMAGE(2);

#define LOAD load_run
#define LOAD_IMAGE image
#define LOAD_NUMBER 1
#define LOAD_CHANNELS SOURCE_CHANNELS
#define LOAD_FROM 0
#define LOAD_COUNT COLUMNS
#include "variants/load.glsl"

#define STORE_COUNT COLUMNS
#include "variants/store.glsl"

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
        [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
            vec4 colour = finite_or_zero(value_of(raw[i]));
            raw[i] = buffer_of(
                apply_threshold(colour, THRESHOLD_MODE, params.threshold, params.knee));
        }
        store(first.x, y, raw);
    }
}
