#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The second half of an upsampling: filters along columns what filter_rows.comp has written, and adds
// the share of the level itself.
#include "lib/block.glsl"
#include "lib/sampling.glsl"
#include "lib/axis.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = TEXEL_COLUMNS(CHANNEL_BYTES);

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, rows);
READ_IMAGE(2, own);
WRITE_IMAGE(3);

#define LOAD load_own
#define LOAD_IMAGE own
#define LOAD_NUMBER 2
#define LOAD_CHANNELS 4
#define LOAD_FROM 0
#define LOAD_COUNT COLUMNS
#include "variants/load.glsl"

#define STORE_COUNT COLUMNS
#include "variants/store.glsl"

#define AXIS_FILTER filter_column
#define AXIS_IMAGE usamplerBuffer image
#define AXIS_TEXEL(at) load_floats(image, read_shapes[0], line, at)
#include "lib/axis_filter.glsl"

#include "variants/row_axis.glsl"

void main()
{
    read_words();
    ivec2 rows_size = READ_SIZE(rows, 1), size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(COLUMNS, FILTER_ROWS));
    int end = min(first.y + FILTER_ROWS, size.y);
    uvec4 raw[COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        raw[i] = uvec4(0);
    for (int y = first.y; y < end; ++y) {
        Axis axis = row_axis(rows_size, y, UPSAMPLE, params.step_y);
        if (ADD_OWN != 0)
            load_own(first.x, y, raw);
        [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
            vec4 sum = params.coarse * filter_column(rows, axis, first.x + i);
            if (ADD_OWN != 0)
                sum += params.own * value_of(raw[i]);
            raw[i] = buffer_of(sum);
        }
        store(first.x, y, raw);
    }
}
