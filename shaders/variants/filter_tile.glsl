// A filter for GPUs, or its transpose. A workgroup computes the weights of its columns and rows once, and an invocation
// adds up RUN rows of a column: each row of texels along x, then these sums along y. With TURNED x and y have changed
// places in all that is here. The results of several PICTURES are added up. The including shader declares `target`,
// includes lib/window.glsl, and defines TURNED, REPEATS and the functions below.

// The texels along x and along y that a pixel adds up.
const int WIDTH = WINDOW_WIDTH, HEIGHT = WINDOW_HEIGHT, MAX_SIDE = WIDTH > HEIGHT ? WIDTH : HEIGHT;
const int COLUMNS = FILTER_TILE_COLUMNS, RUN = FILTER_TILE_RUN;
// Whether sums along x are kept for several rows.
const bool KEEPS = FILTER_TILE_KEEPS(EXACT, KERNELS, WIDTH, HEIGHT);
const int ROWS = FILTER_TILE_ROWS(KEEPS, EXACT_ROWS, HEIGHT);

layout(local_size_x = FILTER_TILE_COLUMNS, local_size_y = FILTER_TILE_RUNS) in;

int picture = 0;

// Defined by the including shader: the texels of the picture that a pixel adds up, a texel there or the nearest one in
// the image, what is added to a pixel, and the pixel that is stored.
Window window_at(int pixel, bool along_x);
vec4 texel_at(ivec2 texel);
vec4 own_at(ivec2 pixel);
vec4 shade(vec4 own, vec4 sum, ivec2 pixel);

ivec2 turned(ivec2 position)
{
    return TURNED ? position.yx : position;
}

// With REPEATS the weights of every second column and row are the same. Windows are of columns, then of rows: the first
// texel, and the weights. A constant's default is 0, which is no size of an array.
const int WINDOWS_X = REPEATS ? 2 : COLUMNS, WINDOWS_Y = REPEATS ? 2 : RUN * FILTER_TILE_RUNS;
shared int firsts[WINDOWS_X + WINDOWS_Y];
shared float weights[MAX_SIDE + 1][WINDOWS_X + WINDOWS_Y][KERNELS > 0 ? KERNELS : 1];

void keep_window(int number, ivec2 tile)
{
    bool along_x = number < WINDOWS_X;
    Window window = window_at(along_x ? tile.x + number : tile.y + number - WINDOWS_X, along_x);
    firsts[number] = window.first;
    [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
        [[unroll]] for (int i = 0; i < MAX_SIDE; ++i)
            weights[i][number][kernel] = window.weights[i][kernel];
}

float column_weight(int kernel, int at, int column)
{
    return weights[at][REPEATS ? column % 2 : column][kernel];
}

float row_weight(int kernel, int at, int top, int row)
{
    return weights[at][WINDOWS_X + (REPEATS ? row % 2 : top + row)][kernel];
}

// Where both sides are in a simple ratio (EXACT, EXACT_ROWS) and there is one kernel: an invocation loads what CHUNK
// columns of a row add up, and keeps their sums. In an odd number of vectors, rows that are stored at once are in
// different banks. (A transposed halving with two kernels takes 0.26 ms with kept sums, 0.14 without: 3840 x 2160 in
// float32, H100, 2026-11-27.)
const int CHUNK = FILTER_TILE_CHUNK(EXACT, EXACT_ROWS), SPAN = WINDOW_SPAN(EXACT, CHUNK, WIDTH);
const int LINES = WINDOW_SPAN(EXACT_ROWS, ROWS, HEIGHT);
shared vec4 kept[KEEPS ? LINES : 1][COLUMNS + 1];
vec4 texels[SPAN];

void keep_sums(int line, int left)
{
    [[unroll]] for (int column = 0; column < CHUNK; ++column) {
        vec4 sum = vec4(0.0);
        [[unroll]] for (int at = 0; at < WIDTH; ++at)
            if (has_weight(TAKEN_X, at, 0))
                sum += column_weight(0, at, REPEATS ? column : left + column)
                     * texels[WINDOW_OFFSET(EXACT, column) + at];
        kept[line][left + column] = sum;
    }
}

// No arguments: of an array whose size depends on a specialization constant, glslang copies as many elements as the
// constant's default says.
float of_column[3][MAX_SIDE + 1];
vec4 of_rows[RUN][3];

vec4[3] sums_along_x(ivec2 first)
{
    vec4 sums[3] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
    [[unroll]] for (int at = 0; at < WIDTH; ++at) {
        vec4 value = texel_at(first + ivec2(at, 0));
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            if (has_weight(TAKEN_X, at, kernel))
                sums[kernel] += of_column[kernel][at] * value;
    }
    return sums;
}

// How far the window of a row is from that of the row `top` of the tile.
int row_offset(int top, int row)
{
    return EXACT != 0 ? WINDOW_OFFSET(EXACT_ROWS, row) : firsts[WINDOWS_X + top + row] - firsts[WINDOWS_X + top];
}

// Adds the sums of a picture.
void sum_up(ivec2 tile, ivec2 first)
{
    int number = int(gl_LocalInvocationIndex), column = int(gl_LocalInvocationID.x);
    int top = RUN * int(gl_LocalInvocationID.y);
    int line = number % LINES, left = CHUNK * (number / LINES);

    // Before the windows, which take as long.
    [[unroll]] for (int i = 0; i < (KEEPS ? SPAN : 0); ++i)
        texels[i] = texel_at(turned(first + ivec2(WINDOW_OFFSET(EXACT, left) + i, line)));
    if (number < WINDOWS_X + WINDOWS_Y)
        keep_window(number, tile);
    barrier();
    ivec2 texel = EXACT != 0 ? first + ivec2(WINDOW_OFFSET(EXACT, column), WINDOW_OFFSET(EXACT_ROWS, top))
                             : ivec2(firsts[column], firsts[WINDOWS_X + top]);
    if (KEEPS) {
        if (left < COLUMNS)
            keep_sums(line, left);
        barrier();
    } else {
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            [[unroll]] for (int at = 0; at < WIDTH; ++at)
                of_column[kernel][at] = column_weight(kernel, at, column);
    }
    int rows = row_offset(top, RUN - 1) + HEIGHT;
    [[unroll]] for (int row = 0; row < rows; ++row) {
        vec4 sums[3];
        if (KEEPS)
            sums[0] = kept[min(texel.y - first.y + row, LINES - 1)][column];
        else
            sums = sums_along_x(texel + ivec2(0, row));
        [[unroll]] for (int i = 0; i < RUN; ++i) {
            int at = row - row_offset(top, i);
            if (at < 0 || at >= HEIGHT)
                continue;
            [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
                if (has_weight(TAKEN_Y, at, kernel))
                    of_rows[i][kernel] += row_weight(kernel, at, top, i) * sums[kernel];
        }
    }
}

void main()
{
    ivec2 tile = ivec2(COLUMNS, ROWS) * turned(ivec2(gl_WorkGroupID.xy)), size = imageSize(target);
    ivec2 first = ivec2(WINDOW_FIRST(EXACT, tile.x, WIDTH), WINDOW_FIRST(EXACT_ROWS, tile.y, HEIGHT));
    ivec2 at = ivec2(1, RUN) * ivec2(gl_LocalInvocationID.xy);
    ivec2 pixels[RUN];
    vec4 own[RUN];

    // First, since they take as long as the rest.
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        pixels[i] = turned(tile + at + ivec2(0, i));
        own[i] = own_at(min(pixels[i], size - 1));
        of_rows[i] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
    }
    sum_up(tile, first);
    while (++picture < PICTURES) {
        barrier();
        sum_up(tile, first);
    }
    [[unroll]] for (int i = 0; i < RUN; ++i)
        if (at.y + i < ROWS && all(lessThan(pixels[i], size)))
            imageStore(target, pixels[i], shade(own[i], sum_of(of_rows[i]), pixels[i]));
}
