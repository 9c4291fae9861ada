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

const int COLUMNS = TEXEL_COLUMNS(CHANNEL_BYTES), ROWS = FILTER_ROWS;

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, rows);
READ_IMAGE(2, own);
WRITE_IMAGE(3);

#include "variants/own.glsl"

#define AXIS_FILTER filter_column
#define AXIS_IMAGE usamplerBuffer image
#define AXIS_TEXEL(at) load_floats(image, read_shapes[0], line, at)
#include "lib/axis_filter.glsl"

#include "variants/row_axis.glsl"

void write_row(int x, int y)
{
    Axis axis = row_axis(READ_SIZE(rows, 1), y, UPSAMPLE, params.step_y);
    uvec4 raw[COLUMNS];

    if (ADD_OWN != 0)
        load_own(x, y, raw);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec4 sum = params.coarse * filter_column(rows, axis, x + i);
        if (ADD_OWN != 0)
            sum += params.own * value_of(raw[i]);
        raw[i] = buffer_of(sum);
    }
    store(x, y, raw);
}

#include "variants/rows.glsl"
