#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The second half of dual Kawase's upsampling: adds up, along columns, what filter_rows.comp has
// written: single taps, and pairs at the distances of the diagonal and of the axial taps.
#include "lib/block.glsl"
#include "lib/sampling.glsl"
#include "lib/axis.glsl"

UNIFORM_BLOCK(KAWASE_BLOCK);
#include "lib/storage.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = TEXEL_COLUMNS(CHANNEL_BYTES);

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, single);
READ_IMAGE(2, diagonal);
READ_IMAGE(3, axial);
WRITE_IMAGE(4);

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
    ivec2 rows_size = READ_SIZE(single, 1), size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(COLUMNS, FILTER_ROWS));
    int end = min(first.y + FILTER_ROWS, size.y);
    uvec4 raw[COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    for (int y = first.y; y < end; ++y) {
        Axis one = row_axis(rows_size, y, UPSAMPLE_LINEAR, 0.0);
        Axis near = row_axis(rows_size, y, UPSAMPLE_PAIR, 0.5 * params.offset);
        Axis far = row_axis(rows_size, y, UPSAMPLE_PAIR, params.offset);
        [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
            int x = first.x + i;
            vec4 sum = filter_column(axial, one, x) + filter_column(single, far, x);
            sum += 2.0 * filter_column(diagonal, near, x);
            raw[i] = buffer_of(sum / 12.0);
        }
        store(first.x, y, raw);
    }
}
