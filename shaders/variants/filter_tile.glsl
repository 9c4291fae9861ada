// A filter for GPUs, or its transpose. A workgroup computes the weights of its columns and rows once. An invocation
// adds up some rows of a column: each row of texels along x once, then these sums along y. The including shader
// declares `target`, includes lib/window.glsl, and defines the functions below.

const int COLUMNS = FILTER_TILE_COLUMNS, ROWS = FILTER_TILE_ROWS, RUN = FILTER_TILE_RUN;

layout(local_size_x = FILTER_TILE_COLUMNS, local_size_y = FILTER_TILE_ROWS / FILTER_TILE_RUN) in;

// Defined by the including shader: the texels of the source that a pixel adds up, a texel there or the nearest one in
// the image, what is added to a pixel, and the pixel that is stored.
Window window_at(ivec2 pixel, bool along_x);
vec4 texel_at(ivec2 texel);
vec4 own_at(ivec2 pixel);
vec4 shade(vec4 own, vec4 sum, ivec2 pixel);

// Where both sides are in a simple ratio (EXACT, EXACT_ROWS), the weights of every RUN columns and rows are the same.
const int WEIGHT_COLUMNS = EXACT != 0 ? RUN : COLUMNS, WEIGHT_ROWS = EXACT != 0 ? RUN : ROWS;

// Of columns, then of rows: the first texel of the window, and the weights. A constant's default is 0, which is
// no size of an array.
shared int firsts[WEIGHT_COLUMNS + WEIGHT_ROWS];
shared vec3 weights[WINDOW + 1][WEIGHT_COLUMNS + WEIGHT_ROWS];

void keep_window(int number, ivec2 first)
{
    bool along_x = number < WEIGHT_COLUMNS;
    Window window = window_at(first + number - (along_x ? 0 : WEIGHT_COLUMNS), along_x);
    firsts[number] = window.first;
    [[unroll]] for (int i = 0; i < WINDOW; ++i)
        weights[i][number] = window.weights[i];
}

// How far the window of a row is from that of the row `top` of the tile.
int row_offset(int top, int row)
{
    return EXACT != 0 ? offset_of(EXACT_ROWS, row) : firsts[WEIGHT_COLUMNS + top + row] - firsts[WEIGHT_COLUMNS + top];
}

void main()
{
    ivec2 tile = ivec2(COLUMNS, ROWS) * ivec2(gl_WorkGroupID.xy), size = imageSize(target);
    int number = int(gl_LocalInvocationIndex), column = int(gl_LocalInvocationID.x);
    int top = RUN * int(gl_LocalInvocationID.y);
    vec4 own[RUN], of_kernels[RUN][3];
    vec3 of_column[WINDOW + 1];

    // First, since they take as long as the rest.
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        own[i] = own_at(min(tile + ivec2(column, top + i), size - 1));
        of_kernels[i] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
    }
    if (number < WEIGHT_COLUMNS + WEIGHT_ROWS)
        keep_window(number, tile);
    barrier();
    [[unroll]] for (int at = 0; at < WINDOW; ++at)
        of_column[at] = weights[at][EXACT != 0 ? column % RUN : column];
    ivec2 first = EXACT != 0
                    ? ivec2(firsts[0] + offset_of(EXACT, column), firsts[WEIGHT_COLUMNS] + offset_of(EXACT_ROWS, top))
                    : ivec2(firsts[column], firsts[WEIGHT_COLUMNS + top]);
    int rows = row_offset(top, RUN - 1) + WINDOW;
    [[unroll]] for (int row = 0; row < rows; ++row) {
        vec4 sums[3] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
        [[unroll]] for (int at = 0; at < WINDOW; ++at) {
            vec4 value = texel_at(first + ivec2(at, row));
            [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
                if (has_weight(TAKEN_X, at, kernel))
                    sums[kernel] += of_column[at][kernel] * value;
        }
        [[unroll]] for (int i = 0; i < RUN; ++i) {
            int at = row - row_offset(top, i);
            if (at < 0 || at >= WINDOW)
                continue;
            vec3 of_row = weights[at][WEIGHT_COLUMNS + (EXACT != 0 ? i : top + i)];
            [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
                if (has_weight(TAKEN_Y, at, kernel))
                    of_kernels[i][kernel] += of_row[kernel] * sums[kernel];
        }
    }
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        ivec2 pixel = tile + ivec2(column, top + i);
        if (all(lessThan(pixel, size)))
            imageStore(target, pixel, shade(own[i], sum_of(of_kernels[i]), pixel));
    }
}
