#pragma compile floats
// The transpose of a filter (see adjoint_filter.frag) in blocks: an invocation loads each pixel once that
// texels next to each other are read by: RADIX_1 columns and RADIX_2 rows, with the weights of a block of
// texels. LEVELS is the number of kernels. BY is as there. In the tiles of GPUs `Pyramid` takes 102 ms
// backwards in place of 32, `BevyBloom` 621 in place of 244 (processor time of 960 x 544 in float32, lavapipe of
// Mesa 22.3.6, 2026-11-27).

UNIFORM_BLOCK(ADJOINT_FILTER_BLOCK);
#include "variants/pixels.glsl"

const int COLUMNS = ADJOINT_SIDE, ROWS = ADJOINT_ROWS, SPAN_X = RADIX_1, SPAN_Y = RADIX_2;

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, cotangents);
READ_IMAGE(2, table);
READ_IMAGE(3, scene);
READ_IMAGE(4, added);
READ_IMAGE(5, differentiated);
WRITE_IMAGE(6);
#include "variants/store.glsl"

// A pixel of the image at a binding.
#define FETCH(name, number, x, y) load_floats(name, read_shapes[number - 1], x, y)

vec4 entry(int place)
{
    return FETCH(table, 2, place % TABLE_WIDTH, place / TABLE_WIDTH);
}

// The weights of pixel `at` for the texels of a block.
vec4 weights_at(vec4 place, int at, int kernel)
{
    int first = int(place.z) + (LEVELS == 1 ? at : ADJOINT_SIDE * at);
    if (LEVELS == 1)
        return entry(first);
    return vec4(entry(first)[kernel], entry(first + 1)[kernel], entry(first + 2)[kernel],
                entry(first + 3)[kernel]);
}

vec4 cotangent_at(int x, int y)
{
    int column = min(x, read_shapes[0].x - 1), row = min(y, read_shapes[0].y - 1);
    vec4 value = FETCH(cotangents, 1, column, row);
    return BY == BY_BLOOM ? vec4(where_finite(value, FETCH(scene, 3, column, row)).rgb, 0.0) : value;
}

// The cotangents of a pixel, as of lib/adjoint.glsl.
vec4 gathered(int x, int y, float share, vec4 found)
{
    if (ADD_OWN != 0)
        found += vec4(vec3(share), 1.0) * FETCH(added, 4, x, y);
    return FROM_IMAGE != 0 ? where_finite(found, FETCH(differentiated, 5, x, y)) : found;
}

// Stores the cotangents of a run of pixels.
void store_gathered(int first, int row, float share, vec4 found[COLUMNS])
{
    uvec4 raw[COLUMNS];

    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        raw[i] = floatBitsToUint(gathered(min(first + i, target_shape.x - 1), row, share, found[i]));
    store(first, row, raw);
}

void along_rows(ivec2 first, int end, int start, float gain, float share)
{
    vec4 place = entry(start + first.x), weights[SPAN_X + 1];

    [[unroll]] for (int i = 0; i < SPAN_X; ++i)
        weights[i] = gain * weights_at(place, i, 0);
    for (int y = first.y; y < end; ++y) {
        vec4 sums[COLUMNS];
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            sums[i] = vec4(0.0);
        [[unroll]] for (int at = 0; at < SPAN_X; ++at) {
            vec4 value = cotangent_at(int(place.w) + at, y);
            [[unroll]] for (int i = 0; i < COLUMNS; ++i)
                sums[i] += weights[at][i] * value;
        }
        store_gathered(first.x, y, share, sums);
    }
}

void along_columns(ivec2 first, int end, int start, float gain, float share)
{
    for (int y = first.y; y < end; y += ADJOINT_SIDE) {
        vec4 place = entry(start + y), sums[ADJOINT_SIDE * COLUMNS];
        [[unroll]] for (int i = 0; i < ADJOINT_SIDE * COLUMNS; ++i)
            sums[i] = vec4(0.0);
        for (int number = 0; number < SPAN_Y; ++number) {
            vec4 weights = gain * weights_at(place, number, 0);
            [[unroll]] for (int column = 0; column < COLUMNS; ++column) {
                vec4 value = cotangent_at(first.x + column, int(place.w) + number);
                [[unroll]] for (int row = 0; row < ADJOINT_SIDE; ++row)
                    sums[row * COLUMNS + column] += weights[row] * value;
            }
        }
        [[unroll]] for (int row = 0; row < ADJOINT_SIDE; ++row) {
            vec4 found[COLUMNS];
            [[unroll]] for (int i = 0; i < COLUMNS; ++i)
                found[i] = sums[row * COLUMNS + i];
            if (y + row < end)
                store_gathered(first.x, y + row, share, found);
        }
    }
}

void across(ivec2 first, int end, ivec2 start, float gain, float share)
{
    vec4 place_x = entry(start.x + first.x), weights[SPAN_X * LEVELS + 1];

    [[unroll]] for (int i = 0; i < SPAN_X * LEVELS; ++i)
        weights[i] = gain * weights_at(place_x, i / LEVELS, i % LEVELS);
    for (int y = first.y; y < end; y += ADJOINT_SIDE) {
        vec4 place_y = entry(start.y + y), sums[ADJOINT_SIDE * COLUMNS];
        [[unroll]] for (int i = 0; i < ADJOINT_SIDE * COLUMNS; ++i)
            sums[i] = vec4(0.0);
        for (int number = 0; number < SPAN_Y; ++number) {
            vec4 values[SPAN_X + 1];
            [[unroll]] for (int i = 0; i < SPAN_X; ++i)
                values[i] = cotangent_at(int(place_x.w) + i, int(place_y.w) + number);
            [[unroll]] for (int kernel = 0; kernel < LEVELS; ++kernel) {
                vec4 shares = weights_at(place_y, number, kernel);
                [[unroll]] for (int column = 0; column < COLUMNS; ++column) {
                    vec4 sum = vec4(0.0);
                    [[unroll]] for (int i = 0; i < SPAN_X; ++i)
                        sum += weights[i * LEVELS + kernel][column] * values[i];
                    [[unroll]] for (int row = 0; row < ADJOINT_SIDE; ++row)
                        sums[row * COLUMNS + column] += shares[row] * sum;
                }
            }
        }
        [[unroll]] for (int row = 0; row < ADJOINT_SIDE; ++row) {
            vec4 found[COLUMNS];
            [[unroll]] for (int i = 0; i < COLUMNS; ++i)
                found[i] = sums[row * COLUMNS + i];
            if (y + row < end)
                store_gathered(first.x, y + row, share, found);
        }
    }
}

void main()
{
    copy_shapes();
    ivec2 size = TARGET_SIZE(), first = first_pixel(ivec2(COLUMNS, ROWS));
    int end = min(first.y + ROWS, size.y);
    ivec2 start = ivec2(params.start_x, params.start_y);
    float gain = params.gain, share = params.share;

    if (any(greaterThanEqual(first, size)))
        return;
    if (DIRECTION == DIRECTION_HORIZONTAL)
        along_rows(first, end, start.x, gain, share);
    else if (DIRECTION == DIRECTION_VERTICAL)
        along_columns(first, end, start.y, gain, share);
    else
        across(first, end, start, gain, share);
}
