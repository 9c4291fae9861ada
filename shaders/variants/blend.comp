#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The composite for a scene and a bloom that have the size and format of the result.
#include "lib/block.glsl"

UNIFORM_BLOCK(COMPOSITE_BLOCK);
#include "lib/storage.glsl"
#include "lib/composite.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = TEXEL_COLUMNS(CHANNEL_BYTES);

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, scene);
READ_IMAGE(2, bloom);
WRITE_IMAGE(3);

#define LOAD load_scene
#define LOAD_IMAGE scene
#define LOAD_NUMBER 1
#define LOAD_CHANNELS SOURCE_CHANNELS
#define LOAD_FROM 0
#define LOAD_COUNT COLUMNS
#include "variants/load.glsl"

#define LOAD load_bloom
#define LOAD_IMAGE bloom
#define LOAD_NUMBER 2
#define LOAD_CHANNELS 4
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
    uvec4 raw[COLUMNS], light[COLUMNS];

    if (first.x >= size.x)
        return;
    for (int y = first.y; y < end; ++y) {
        load_scene(first.x, y, raw);
        load_bloom(first.x, y, light);
        [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
            vec4 sum = finish(value_of(raw[i]), value_of(light[i]), ivec2(first.x + i, y));
            raw[i] = finished(raw[i], sum);
        }
        store(first.x, y, raw);
    }
}
