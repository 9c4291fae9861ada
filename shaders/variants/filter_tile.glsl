// A filter for GPUs. A workgroup computes the weights of its columns and rows once, and filters each row of the
// source that it needs along x once, into shared memory. From there an invocation adds up some rows of a column:
// where the ratio of heights is simple (EXACT_ROWS) it loads what these share once. The including shader includes
// sampling.glsl, declares `source`, `own` and `target`, and defines HAS_OWN, whether `own` is read, and shade(),
// which makes a pixel of that of `own` and of the filtered one.
#include "lib/filter.glsl"

const int RUN = FILTER_TILE_RUN;

layout(local_size_x_id = 34, local_size_y = FILTER_TILE_ROWS / FILTER_TILE_RUN) in;

// Columns, then rows: the first texel of the window, and the weights. A constant's default is 0, which is
// no size of an array.
shared int firsts[GROUP_WIDTH + FILTER_TILE_ROWS];
shared vec3 weights[WINDOW + 1][GROUP_WIDTH + FILTER_TILE_ROWS];
shared vec4 sums[KERNELS * SOURCE_ROWS + 1][GROUP_WIDTH + 1];

void keep_window(int number, ivec2 pixel)
{
    ivec2 size = textureSize(source, 0);
    vec2 target_size = vec2(params.target_width, params.target_height);
    Place place = place_in(source, pixel, ivec2(target_size));
    bool along_x = number < GROUP_WIDTH;
    Axis axis = axis_x(place, size, vec2(size) / target_size);
    if (!along_x)
        axis = axis_y(place, size, vec2(size) / target_size);
    Window window = window_of(settled(axis), WINDOW, along_x);
    firsts[number] = window.first;
    [[unroll]] for (int i = 0; i < WINDOW; ++i)
        weights[i][number] = window.weights[i];
}

void keep_sums(int column, int row, int line)
{
    vec4 sum[3] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
    [[unroll]] for (int i = 0; i < WINDOW; ++i) {
        vec4 texel = fetch_clamped(source, ivec2(firsts[column] + i, line));
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            if (has_weight(TAKEN_X, i, kernel))
                sum[kernel] += weights[i][column][kernel] * texel;
    }
    [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
        sums[kernel * SOURCE_ROWS + row][column] = sum[kernel];
}

// How far the window of a pixel of a run is below that of the first one, if heights are in a simple ratio.
int offset_of(int pixel)
{
    return EXACT_ROWS == EXACT_HALF ? 2 * pixel : EXACT_ROWS == EXACT_SAME ? pixel : (pixel + 1) / 2;
}

void add_run(int column, int top, int line, inout vec4 of_kernels[RUN][3])
{
    int first = firsts[GROUP_WIDTH + top] - line;
    [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
        [[unroll]] for (int row = 0; row < MAX_WINDOW + 2 * RUN; ++row)
            if (row < WINDOW + offset_of(RUN - 1)) {
                vec4 sum = sums[kernel * SOURCE_ROWS + first + row][column];
                [[unroll]] for (int i = 0; i < RUN; ++i) {
                    int at = row - offset_of(i);
                    if (at >= 0 && at < WINDOW && has_weight(TAKEN_Y, at, kernel))
                        of_kernels[i][kernel] += weights[at][GROUP_WIDTH + top + i][kernel] * sum;
                }
            }
}

void add_rows(int column, int top, int line, inout vec4 of_kernels[RUN][3])
{
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        int first = firsts[GROUP_WIDTH + top + i] - line;
        [[unroll]] for (int at = 0; at < WINDOW; ++at)
            [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
                if (has_weight(TAKEN_Y, at, kernel))
                    of_kernels[i][kernel] += weights[at][GROUP_WIDTH + top + i][kernel]
                                           * sums[kernel * SOURCE_ROWS + first + at][column];
    }
}

void main()
{
    const int RUNS = FILTER_TILE_ROWS / RUN;
    ivec2 first = ivec2(gl_WorkGroupID.xy) * ivec2(GROUP_WIDTH, FILTER_TILE_ROWS), size = imageSize(target);
    int number = int(gl_LocalInvocationIndex), column = int(gl_LocalInvocationID.x);
    int top = RUN * int(gl_LocalInvocationID.y);
    vec4 level[RUN], of_kernels[RUN][3];

    // First, since they take as long as the tile.
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        level[i] = HAS_OWN ? texelFetch(own, min(first + ivec2(column, top + i), size - 1), 0) : vec4(0.0);
        of_kernels[i] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
    }
    if (number < GROUP_WIDTH)
        keep_window(number, first + number);
    else if (number < GROUP_WIDTH + FILTER_TILE_ROWS)
        keep_window(number, first + number - GROUP_WIDTH);
    barrier();
    int line = firsts[GROUP_WIDTH];
    int rows = firsts[GROUP_WIDTH + FILTER_TILE_ROWS - 1] + WINDOW - line;
    for (int row = int(gl_LocalInvocationID.y); row < rows; row += RUNS)
        keep_sums(column, row, line + row);
    barrier();
    if (EXACT_ROWS != 0)
        add_run(column, top, line, of_kernels);
    else
        add_rows(column, top, line, of_kernels);
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        ivec2 pixel = first + ivec2(column, top + i);
        vec4 sum = params.coarse * (sum_of(of_kernels[i]) / params.divisor);
        if (all(lessThan(pixel, size)))
            imageStore(target, pixel, shade(level[i], sum, pixel));
    }
}
