// A filter for GPUs, or its transpose. A workgroup computes the weights of its columns and rows once, and adds up
// each row of the source that it needs along x once, into shared memory. From there an invocation adds up some rows
// of a column: where the ratio of heights is simple (EXACT_ROWS) it loads what these share once. The including
// shader declares `target`, includes lib/window.glsl, and defines the functions below.

const int RUN = FILTER_TILE_RUN;

layout(local_size_x_id = 34, local_size_y = FILTER_TILE_ROWS / FILTER_TILE_RUN) in;

// Defined by the including shader: the texels of the source that a pixel adds up, a texel there or the nearest one in
// the image, what is added to a pixel, and the pixel that is stored.
Window window_at(ivec2 pixel, bool along_x);
vec4 texel_at(ivec2 texel);
vec4 own_at(ivec2 pixel);
vec4 shade(vec4 own, vec4 sum, ivec2 pixel);

// Columns, then rows: the first texel of the window, and the weights. A constant's default is 0, which is
// no size of an array.
shared int firsts[GROUP_WIDTH + FILTER_TILE_ROWS];
shared vec3 weights[WINDOW + 1][GROUP_WIDTH + FILTER_TILE_ROWS];
shared vec4 sums[KERNELS * SOURCE_ROWS + 1][GROUP_WIDTH + 1];

void keep_window(int number, ivec2 pixel)
{
    Window window = window_at(pixel, number < GROUP_WIDTH);
    firsts[number] = window.first;
    [[unroll]] for (int i = 0; i < WINDOW; ++i)
        weights[i][number] = window.weights[i];
}

void keep_sums(int column, int row, int line)
{
    vec4 sum[3] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
    [[unroll]] for (int i = 0; i < WINDOW; ++i) {
        vec4 texel = texel_at(ivec2(firsts[column] + i, line));
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
    vec4 own[RUN], of_kernels[RUN][3];

    // First, since they take as long as the tile.
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        own[i] = own_at(min(first + ivec2(column, top + i), size - 1));
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
        if (all(lessThan(pixel, size)))
            imageStore(target, pixel, shade(own[i], sum_of(of_kernels[i]), pixel));
    }
}
