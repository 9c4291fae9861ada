// A filter for GPUs, or its transpose. A workgroup computes the weights of its columns and rows once, and adds up
// each row of the source that it needs along x once, into shared memory. From there an invocation adds up some rows
// of a column. What these share is loaded once where the ratio of heights is simple (EXACT_ROWS), and what columns
// share where windows have PHASES. The including shader declares `target`, includes lib/window.glsl, and defines the
// functions below.

const int RUN = FILTER_TILE_RUN;

layout(local_size_x_id = 34, local_size_y = FILTER_TILE_ROWS / FILTER_TILE_RUN) in;

// Defined by the including shader: the texels of the source that a pixel adds up, a texel there or the nearest one in
// the image, what is added to a pixel, and the pixel that is stored.
Window window_at(ivec2 pixel, bool along_x);
vec4 texel_at(ivec2 texel);
vec4 own_at(ivec2 pixel);
vec4 shade(vec4 own, vec4 sum, ivec2 pixel);

// Where both sides are in a simple ratio, columns share texels, and the weights of every RUN columns and rows of a
// filter are the same. Those of a transposed filter are others at the edges.
#ifndef IS_TRANSPOSED
#define IS_TRANSPOSED false
#endif
const bool SIMPLE = EXACT != 0 && EXACT_ROWS != 0, PHASES = SIMPLE && !IS_TRANSPOSED;
const int WEIGHT_COLUMNS = PHASES ? RUN : GROUP_WIDTH, WEIGHT_ROWS = PHASES ? RUN : FILTER_TILE_ROWS;
// Columns that share texels, since fetches take most of the time: halving 3840 x 2160 of float32 takes 163 us on an
// H100, 188 with two columns, 242 with one.
const int COLUMNS = !SIMPLE ? 1 : EXACT == EXACT_HALF ? RUN : RUN / 2;

// Of columns, then of rows: the first texel of the window, and the weights. A constant's default is 0, which is
// no size of an array.
shared int firsts[WEIGHT_COLUMNS + WEIGHT_ROWS];
shared vec3 weights[WINDOW + 1][WEIGHT_COLUMNS + WEIGHT_ROWS];
shared vec4 sums[KERNELS * SOURCE_ROWS + 1][GROUP_WIDTH + 1];

void keep_window(int number, ivec2 first)
{
    bool along_x = number < WEIGHT_COLUMNS;
    Window window = window_at(first + number - (along_x ? 0 : WEIGHT_COLUMNS), along_x);
    firsts[number] = window.first;
    [[unroll]] for (int i = 0; i < WINDOW; ++i)
        weights[i][number] = window.weights[i];
}

int first_column(ivec2 first, int column)
{
    return SIMPLE ? exact_first(EXACT, first.x + column, WINDOW) : firsts[column];
}

int first_row(ivec2 first, int row)
{
    return EXACT_ROWS != 0 ? exact_first(EXACT_ROWS, first.y + row, WINDOW) : firsts[WEIGHT_COLUMNS + row];
}

// Adds up a row of the tile along x, and each of `step` rows from it on, at this column and those beside it.
void keep_sums(ivec2 first, int column, int row, int step)
{
    int left = first_column(first, column), top = first_row(first, 0);
    int rows = first_row(first, FILTER_TILE_ROWS - 1) + WINDOW - top;
    vec3 of_columns[COLUMNS][WINDOW + 1];

    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        [[unroll]] for (int at = 0; at < WINDOW; ++at)
            of_columns[i][at] = weights[at][PHASES ? i : column + i];
    for (; row < rows; row += step) {
        vec4 kept[COLUMNS][3];
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            kept[i] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
        [[unroll]] for (int texel = 0; texel < WINDOW + offset_of(EXACT, COLUMNS - 1); ++texel) {
            vec4 value = texel_at(ivec2(left + texel, top + row));
            [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
                int at = texel - offset_of(EXACT, i);
                [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
                    if (at >= 0 && at < WINDOW && has_weight(TAKEN_X, at, kernel))
                        kept[i][kernel] += of_columns[i][at][kernel] * value;
            }
        }
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
                sums[kernel * SOURCE_ROWS + row][column + i] = kept[i][kernel];
    }
}

vec3 weights_of_row(int row, int at)
{
    return weights[at][WEIGHT_COLUMNS + (PHASES ? row % RUN : row)];
}

// Rows from `first` of the tile on.
void add_run(int column, int top, int first, inout vec4 of_kernels[RUN][3])
{
    [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
        [[unroll]] for (int row = 0; row < MAX_WINDOW + 2 * RUN; ++row)
            if (row < WINDOW + offset_of(EXACT_ROWS, RUN - 1)) {
                vec4 sum = sums[kernel * SOURCE_ROWS + first + row][column];
                [[unroll]] for (int i = 0; i < RUN; ++i) {
                    int at = row - offset_of(EXACT_ROWS, i);
                    if (at >= 0 && at < WINDOW && has_weight(TAKEN_Y, at, kernel))
                        of_kernels[i][kernel] += weights_of_row(top + i, at)[kernel] * sum;
                }
            }
}

void add_rows(int column, int top, ivec2 first, inout vec4 of_kernels[RUN][3])
{
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        int from = first_row(first, top + i) - first_row(first, 0);
        [[unroll]] for (int at = 0; at < WINDOW; ++at)
            [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
                if (has_weight(TAKEN_Y, at, kernel))
                    of_kernels[i][kernel] += weights_of_row(top + i, at)[kernel]
                                           * sums[kernel * SOURCE_ROWS + from + at][column];
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
    if (number < WEIGHT_COLUMNS + WEIGHT_ROWS)
        keep_window(number, first);
    barrier();
    keep_sums(first, COLUMNS * number % GROUP_WIDTH, COLUMNS * number / GROUP_WIDTH, COLUMNS * RUNS);
    barrier();
    if (EXACT_ROWS != 0)
        add_run(column, top, first_row(first, top) - first_row(first, 0), of_kernels);
    else
        add_rows(column, top, first, of_kernels);
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        ivec2 pixel = first + ivec2(column, top + i);
        if (all(lessThan(pixel, size)))
            imageStore(target, pixel, shade(own[i], sum_of(of_kernels[i]), pixel));
    }
}
