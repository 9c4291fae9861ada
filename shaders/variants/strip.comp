#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The complete bloom of an image for devices without fast shared memory. An invocation writes a
// strip from top to bottom and keeps the vertical sums of the following rows in registers.
#include "variants/fused_bloom.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = STRIP_COLUMNS(CHANNEL_BYTES);
const int SUMS = 2 * STRIP_RADIUS;
const int LOADED = COLUMNS + 2 * STRIP_RADIUS;

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, image);
WRITE_IMAGE(2);

#define LOAD load_wide
#define LOAD_IMAGE image
#define LOAD_NUMBER 1
#define LOAD_CHANNELS 4
#define LOAD_FROM -STRIP_RADIUS
#define LOAD_COUNT LOADED
#include "variants/load.glsl"

#define LOAD load_own
#define LOAD_IMAGE image
#define LOAD_NUMBER 1
#define LOAD_CHANNELS 4
#define LOAD_FROM 0
#define LOAD_COUNT COLUMNS
#include "variants/load.glsl"

#define STORE_COUNT COLUMNS
#include "variants/store.glsl"

void main()
{
    read_words();
    ivec2 size = READ_SIZE(image, 1);
    ivec2 first = first_pixel(ivec2(COLUMNS, STRIP_ROWS));
    int end = min(first.y + STRIP_ROWS, size.y);
    vec3 sums[SUMS][LOADED];
    vec3 line[LOADED];
    uvec4 raw[LOADED], own[COLUMNS];
    float weights[STRIP_RADIUS + 1], row_weights[STRIP_RADIUS + 1];

    if (any(greaterThanEqual(first, size)))
        return;
    [[unroll]] for (int i = 0; i <= STRIP_RADIUS; ++i) {
        weights[i] = vertical_weight(i);
        row_weights[i] = horizontal_weight(i);
    }
    [[unroll]] for (int row = 0; row < SUMS; ++row)
        [[unroll]] for (int i = 0; i < LOADED; ++i)
            sums[row][i] = vec3(0.0);
    // All other loops are unrolled; otherwise the sums would be in memory.
    for (int y = first.y - STRIP_RADIUS; y < end + STRIP_RADIUS; ++y) {
        load_wide(first.x, clamp(y, 0, size.y - 1), raw);
        [[unroll]] for (int i = 0; i < LOADED; ++i)
            line[i] = thresholded(value_of(raw[i]).rgb);
        [[unroll]] for (int i = 0; i < LOADED; ++i) {
            vec3 added = line[i];
            // Completes the current row and moves the sums of the following rows by one place.
            line[i] = as_stored(sums[0][i] + weights[STRIP_RADIUS] * added, FORMAT);
            [[unroll]] for (int tap = 1; tap < SUMS; ++tap)
                sums[tap - 1][i] = sums[tap][i] + weights[abs(STRIP_RADIUS - tap)] * added;
            sums[SUMS - 1][i] = weights[STRIP_RADIUS] * added;
        }
        if (y < first.y + STRIP_RADIUS)
            continue;
        load_own(first.x, y - STRIP_RADIUS, own);
        [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
            ivec2 pixel = ivec2(first.x + i, y - STRIP_RADIUS);
            vec3 sum = vec3(0.0);
            [[unroll]] for (int tap = -STRIP_RADIUS; tap <= STRIP_RADIUS; ++tap)
                sum += row_weights[abs(tap)] * line[i + STRIP_RADIUS + tap];
            vec4 bloom = vec4(as_stored(sum, FORMAT), 1.0);
            own[i] = finished(own[i], finish(value_of(own[i]), bloom, pixel));
        }
        store(first.x, y - STRIP_RADIUS, own);
    }
}
