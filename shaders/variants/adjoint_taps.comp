// The transpose of a filter in blocks: an invocation loads each pixel once that texels next to each other are read
// by: SPAN_WIDTH columns and SPAN_HEIGHT rows, with the weights of a block of texels. There are KERNELS. In the
// tiles of GPUs `Pyramid` takes 102 ms backwards in place of 32, `BevyBloom` 621 in place of 244 (processor time of
// 960 x 544 in float32, lavapipe of Mesa 22.3.6, 2026-11-27).
#include "variants/pixels.glsl"
#include "lib/adjoint_filter.glsl"

const bool ALONG_X = DIRECTION != DIRECTION_VERTICAL, ALONG_Y = DIRECTION != DIRECTION_HORIZONTAL;
const int COLUMNS = ADJOINT_SIDE, ROWS = ALONG_Y ? ADJOINT_SIDE : 1;
const int SPAN_X = ALONG_X ? SPAN_WIDTH : COLUMNS;

layout(local_size_x = ROW_INVOCATIONS) in;
#include "variants/store.glsl"

// The weights of columns in all kernels.
vec4 weights[SPAN_X * KERNELS + 1];

// Adds a row of cotangents to the texels of the block, whose weights begin at this entry.
void add_row(ivec2 first, int place, inout vec4 sums[ROWS][COLUMNS])
{
    vec4 values[SPAN_X + 1];

    [[unroll]] for (int i = 0; i < SPAN_X; ++i)
        values[i] = texel_at(first + ivec2(i, 0));
    [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel) {
        vec4 shares = entry(place + kernel);
        [[unroll]] for (int column = 0; column < COLUMNS; ++column) {
            vec4 sum = ALONG_X ? vec4(0.0) : values[column];
            [[unroll]] for (int i = 0; i < (ALONG_X ? SPAN_X : 0); ++i)
                sum += weights[i * KERNELS + kernel][column] * values[i];
            [[unroll]] for (int row = 0; row < ROWS; ++row)
                sums[row][column] += shares[row] * sum;
        }
    }
}

// The same along rows alone. They may have many weights, so no value is kept.
void add_line(ivec2 first, inout vec4 sums[COLUMNS])
{
    [[unroll]] for (int i = 0; i < SPAN_X; ++i) {
        vec4 value = texel_at(first + ivec2(i, 0));
        [[unroll]] for (int column = 0; column < COLUMNS; ++column)
            sums[column] += weights[i][column] * value;
    }
}

void store_row(ivec2 first, vec4 sums[COLUMNS])
{
    uvec4 raw[COLUMNS];

    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        ivec2 pixel = ivec2(min(first.x + i, target_shape.x - 1), first.y);
        raw[i] = floatBitsToUint(shade(added_at(pixel), sums[i], pixel));
    }
    store(first.x, first.y, raw);
}

void main()
{
    copy_shapes();
    ivec2 size = TARGET_SIZE(), first = first_pixel(ivec2(COLUMNS, ADJOINT_ROWS));
    int end = min(first.y + ADJOINT_ROWS, size.y), start_y = params.start_y;

    if (any(greaterThanEqual(first, size)))
        return;
    vec4 columns = ALONG_X ? entry(params.start_x + first.x) : vec4(first.x);
    [[unroll]] for (int i = 0; i < SPAN_X * KERNELS; ++i)
        weights[i] = ALONG_X ? entry(int(columns.z) + i) : vec4(1.0);
    for (int y = first.y; y < end; y += ROWS) {
        vec4 rows = ALONG_Y ? entry(start_y + y) : vec4(y);
        vec4 sums[ROWS][COLUMNS];
        [[unroll]] for (int row = 0; row < ROWS; ++row)
            [[unroll]] for (int i = 0; i < COLUMNS; ++i)
                sums[row][i] = vec4(0.0);
        // (llvmpipe would run a loop of one round twice.)
        if (ALONG_Y)
            for (int number = 0; number < SPAN_HEIGHT; ++number)
                add_row(ivec2(int(columns.w), int(rows.w) + number), int(rows.z) + KERNELS * number, sums);
        else
            add_line(ivec2(int(columns.w), y), sums[0]);
        [[unroll]] for (int row = 0; row < ROWS; ++row)
            if (y + row < end)
                store_row(ivec2(first.x, y + row), sums[row]);
    }
}
