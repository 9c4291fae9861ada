#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The first half of an upsampling: filters an image along rows, at the positions of the pixels of a
// target of another width. The results are floats, in an image of the target's width and of the
// image's height.
#include "lib/block.glsl"
#include "lib/sampling.glsl"
#include "lib/axis.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"
#include "variants/pixels.glsl"

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, source);
WRITE_IMAGE(2);

#define AXIS_FILTER filter_row
#define AXIS_IMAGE usamplerBuffer image
#define AXIS_TEXEL(at) load_pixel(image, read_shapes[0], clamp(at, 0, read_shapes[0].x - 1), line)
#include "lib/axis_filter.glsl"

#include "variants/store_float.glsl"

void main()
{
    read_words();
    ivec2 source_size = READ_SIZE(source, 1), size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(FILTER_COLUMNS, FILTER_ROWS));
    int end = min(first.y + FILTER_ROWS, size.y);
    Axis axes[FILTER_COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    [[unroll]] for (int i = 0; i < FILTER_COLUMNS; ++i)
        axes[i] = axis_x(place_in_size(source_size, ivec2(first.x + i, 0), size), UPSAMPLE,
                         params.step_x, source_size, vec2(source_size) / vec2(size));
    for (int y = first.y; y < end; ++y) {
        vec4 sums[FILTER_COLUMNS];
        [[unroll]] for (int i = 0; i < FILTER_COLUMNS; ++i)
            sums[i] = filter_row(source, axes[i], y);
        [[unroll]] for (int i = 0; i < FILTER_COLUMNS; ++i)
            store_float(first.x + i, y, sums[i]);
    }
}
