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

// Defined by the including shader: the texels of the picture that a pixel adds up, a texel there or the nearest one in
// the image, what is added to a pixel, and the pixel that is stored.
Window window_at(int picture, int pixel, bool along_x);
vec4 texel_at(ivec2 texel);
vec4 added_at(ivec2 pixel);
vec4 shade(vec4 own, vec4 sum, ivec2 pixel);

ivec2 turned(ivec2 position)
{
    return TURNED ? position.yx : position;
}

// The tile of a workgroup: its first pixel, and where both sides are in a simple ratio the first texel of its windows.
struct Tile {
    ivec2 pixel, texel;
};

Tile tile_of(ivec2 workgroup)
{
    ivec2 pixel = ivec2(COLUMNS, ROWS) * turned(workgroup);
    return Tile(pixel, ivec2(WINDOW_FIRST(EXACT, pixel.x, WIDTH), WINDOW_FIRST(EXACT_ROWS, pixel.y, HEIGHT)));
}

// The pixels of an invocation, which are RUN rows of a column: the column in the tile and the uppermost row.
struct Run {
    int column, top;
};

// With REPEATS the weights of every second column and row are the same. Windows are of columns, then of rows, of one
// picture after another: the first texel, and the weights. A constant's default is 0, which is no size of an array.
const int WINDOWS_X = REPEATS ? 2 : COLUMNS, WINDOWS_Y = REPEATS ? 2 : RUN * FILTER_TILE_RUNS;
const int WINDOWS = WINDOWS_X + WINDOWS_Y;
shared int firsts[WINDOWS * (PICTURES > 0 ? PICTURES : 1)];
shared float weights[MAX_SIDE + 1][WINDOWS * (PICTURES > 0 ? PICTURES : 1)][KERNELS > 0 ? KERNELS : 1];

void keep_window(int picture, int number, Tile tile)
{
    bool along_x = number < WINDOWS_X;
    int pixel = along_x ? tile.pixel.x + number : tile.pixel.y + number - WINDOWS_X;
    int place = picture * WINDOWS + number;
    Window window = window_at(picture, pixel, along_x);
    firsts[place] = window.first;
    [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
        [[unroll]] for (int i = 0; i < MAX_SIDE; ++i)
            weights[i][place][kernel] = window.weights[i][kernel];
}

float column_weight(int kernel, int at, int column)
{
    return weights[at][REPEATS ? column % 2 : column][kernel];
}

float row_weight(int kernel, int at, int row)
{
    return weights[at][WINDOWS_X + (REPEATS ? row % 2 : row)][kernel];
}

// Arrays that are arguments or results have constant sizes. Of an array whose size depends on a specialization
// constant, glslang copies as many elements as the constant's default says.

// Where both sides are in a simple ratio (EXACT, EXACT_ROWS) and there is one kernel: an invocation loads what CHUNK
// columns of a row add up, and keeps their sums. In an odd number of vectors, rows that are stored at once are in
// different banks. (A transposed halving with two kernels takes 0.26 ms with kept sums, 0.14 without: 3840 x 2160 in
// float32, H100, 2026-11-27.)
const int CHUNK = FILTER_TILE_CHUNK(EXACT, EXACT_ROWS), SPAN = WINDOW_SPAN(EXACT, CHUNK, WIDTH);
const int MAX_SPAN = WINDOW_SPAN(EXACT_HALF, 8, FILTER_TILE_WINDOW);
const int LINES = WINDOW_SPAN(EXACT_ROWS, ROWS, HEIGHT);
shared vec4 kept[KEEPS ? LINES : 1][COLUMNS + 1];

// What an invocation loads and keeps: the columns from `left` on of a row of texels of the tile.
struct Chunk {
    int line, left;
};

vec4[MAX_SPAN] texels_of(Chunk chunk, Tile tile)
{
    vec4 texels[MAX_SPAN];
    [[unroll]] for (int i = 0; i < SPAN; ++i)
        texels[i] = texel_at(turned(tile.texel + ivec2(WINDOW_OFFSET(EXACT, chunk.left) + i, chunk.line)));
    return texels;
}

void keep_sums(Chunk chunk, vec4 texels[MAX_SPAN])
{
    [[unroll]] for (int i = 0; i < CHUNK; ++i) {
        vec4 sum = vec4(0.0);
        [[unroll]] for (int at = 0; at < WIDTH; ++at)
            if (has_weight(TAKEN_X, at, 0))
                sum += column_weight(0, at, REPEATS ? i : chunk.left + i) * texels[WINDOW_OFFSET(EXACT, i) + at];
        kept[chunk.line][chunk.left + i] = sum;
    }
}

// The weights of a column in each kernel. Each row of texels needs them all: they are loaded once.
float[3][WINDOW_WEIGHTS] weights_of(int column)
{
    float found[3][WINDOW_WEIGHTS];
    [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
        [[unroll]] for (int at = 0; at < WIDTH; ++at)
            found[kernel][at] = column_weight(kernel, at, column);
    return found;
}

// The sums of a row of texels from `first` on in each kernel.
vec4[3] sums_along_x(ivec2 first, float weights_of_column[3][WINDOW_WEIGHTS])
{
    vec4 sums[3] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
    [[unroll]] for (int at = 0; at < WIDTH; ++at) {
        vec4 value = texel_at(first + ivec2(at, 0));
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            if (has_weight(TAKEN_X, at, kernel))
                sums[kernel] += weights_of_column[kernel][at] * value;
    }
    return sums;
}

// The first texel of a run's windows.
ivec2 first_texel(Tile tile, Run run)
{
    if (EXACT != 0)
        return tile.texel + ivec2(WINDOW_OFFSET(EXACT, run.column), WINDOW_OFFSET(EXACT_ROWS, run.top));
    return ivec2(firsts[run.column], firsts[WINDOWS_X + run.top]);
}

// How far the window of a pixel of a run is from that of the uppermost one.
int row_offset(Run run, int pixel)
{
    if (EXACT != 0)
        return WINDOW_OFFSET(EXACT_ROWS, pixel);
    return firsts[WINDOWS_X + run.top + pixel] - firsts[WINDOWS_X + run.top];
}

// Adds a row of texels, whose sums along x these are, to all pixels whose windows contain it.
void add_row(int row, vec4 along_x[3], Run run, inout vec4 sums[RUN][3])
{
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        int at = row - row_offset(run, i);
        if (at < 0 || at >= HEIGHT)
            continue;
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            if (has_weight(TAKEN_Y, at, kernel))
                sums[i][kernel] += row_weight(kernel, at, REPEATS ? i : run.top + i) * along_x[kernel];
    }
}

// Adds the sums of the image in each kernel to those of a run.
void add_image(Tile tile, Run run, inout vec4 sums[RUN][3])
{
    int number = int(gl_LocalInvocationIndex);
    Chunk chunk = Chunk(number % LINES, CHUNK * (number / LINES));
    vec4 texels[MAX_SPAN];
    float weights_of_column[3][WINDOW_WEIGHTS];

    // Before the windows, which take as long.
    if (KEEPS)
        texels = texels_of(chunk, tile);
    if (number < WINDOWS)
        keep_window(0, number, tile);
    barrier();
    ivec2 texel = first_texel(tile, run);
    if (KEEPS) {
        if (chunk.left < COLUMNS)
            keep_sums(chunk, texels);
        barrier();
    } else {
        weights_of_column = weights_of(run.column);
    }
    int rows = row_offset(run, RUN - 1) + HEIGHT;
    [[unroll]] for (int row = 0; row < rows; ++row) {
        vec4 along_x[3];
        if (KEEPS)
            along_x[0] = kept[min(texel.y - tile.texel.y + row, LINES - 1)][run.column];
        else
            along_x = sums_along_x(texel + ivec2(0, row), weights_of_column);
        add_row(row, along_x, run, sums);
    }
}

// Adds all pictures, of which each has one kernel, to the sums of a run: windows of width x height texels.
void add_windows(int width, int height, Run run, inout vec4 sums[RUN][3])
{
    [[unroll]] for (int picture = 0; picture < PICTURES; ++picture) {
        int column = picture * WINDOWS + run.column;
        [[unroll]] for (int i = 0; i < RUN; ++i) {
            int row = picture * WINDOWS + run.top + i;
            ivec2 first = ivec2(firsts[column], firsts[WINDOWS_X + row]);
            [[unroll]] for (int y = 0; y < height; ++y) {
                vec4 sum = vec4(0.0);
                [[unroll]] for (int x = 0; x < width; ++x)
                    sum += column_weight(0, x, column) * texel_at(first + ivec2(x, y));
                sums[i][0] += row_weight(0, y, row) * sum;
            }
        }
    }
}

// Whether no window of the workgroup has more than INNER texels, which those at edges may have.
shared bool is_inner;

// The same with the windows of all pictures. Each pixel of a run loads its own texels, so that no load waits for another
// one: thirteen pictures of 1920 x 1080 take 0.38 ms in place of 0.54, four of 3840 x 2160 0.22 in place of 0.30
// (float32, H200, 2026-11-30).
void add_pictures(Tile tile, Run run, inout vec4 sums[RUN][3])
{
    is_inner = true;
    barrier();
    for (int place = int(gl_LocalInvocationIndex); place < PICTURES * WINDOWS; place += COLUMNS * FILTER_TILE_RUNS) {
        keep_window(place / WINDOWS, place % WINDOWS, tile);
        [[unroll]] for (int i = INNER; i < MAX_SIDE; ++i)
            if (weights[i][place][0] != 0.0)
                is_inner = false;
    }
    barrier();
    if (is_inner)
        add_windows(INNER, INNER, run, sums);
    else
        add_windows(WIDTH, HEIGHT, run, sums);
}

void main()
{
    Tile tile = tile_of(ivec2(gl_WorkGroupID.xy));
    Run run = Run(int(gl_LocalInvocationID.x), RUN * int(gl_LocalInvocationID.y));
    ivec2 first = tile.pixel + ivec2(run.column, run.top), size = imageSize(target), pixels[RUN];
    vec4 own[RUN], sums[RUN][3];

    // First, since they take as long as the rest.
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        pixels[i] = turned(first + ivec2(0, i));
        own[i] = added_at(min(pixels[i], size - 1));
        sums[i] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
    }
    if (PICTURES > 1)
        add_pictures(tile, run, sums);
    else
        add_image(tile, run, sums);
    [[unroll]] for (int i = 0; i < RUN; ++i)
        if (run.top + i < ROWS && all(lessThan(pixels[i], size)))
            imageStore(target, pixels[i], shade(own[i], sum_of(sums[i]), pixels[i]));
}
