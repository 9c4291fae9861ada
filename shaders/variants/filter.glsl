// A filter of an image of any size in strips. An invocation writes a strip from top to bottom. It filters
// each row of the source along the row once, for each kernel, and keeps the filtered rows that a pixel
// needs. The including shader includes sampling.glsl and nested.glsl, and defines seen(), by which texels
// are changed.
#include "lib/filter.glsl"

const int COLUMNS = WINDOW_COLUMNS(CHANNEL_BYTES);
// The rows and columns that a pixel needs. At HDRP's border their place differs from the position's.
const int KEPT = IS_INSET ? WINDOW + 2 : WINDOW;

#include "variants/own.glsl"

// The texels of a row are a run where the width of the source is in a simple ratio (EXACT) to the target's.
// The compiler removes loads that no window needs.
const int BEFORE = MAX_WINDOW / 2, LOADED = 2 * COLUMNS + MAX_WINDOW;
#define LOAD load_run
#define LOAD_IMAGE source
#define LOAD_NUMBER 1
#define LOAD_FROM (-MAX_WINDOW / 2)
#define LOAD_COUNT LOADED
#include "variants/load.glsl"

Window windows[COLUMNS];
// (A constant that is given at random may be 0, an array's length not.)
const int KEPT_ROWS = KEPT * KERNELS > 0 ? KEPT * KERNELS : 1;
vec4 rows[KEPT_ROWS][COLUMNS];

// The texel at or before the position of a column, in texels of the run.
int texel_in_run(int column)
{
    return BEFORE
         + (EXACT == EXACT_HALF       ? 2 * column
                : EXACT == EXACT_SAME ? column
                                       : (column + 1) / 2 - 1);
}

void add_row(int row, int first)
{
    int line = clamp(row, 0, read_shapes[0].y - 1), last = read_shapes[0].x - 1;
    uvec4 raw[LOADED];

    if (EXACT != 0)
        load_run(EXACT == EXACT_HALF   ? 2 * first
                 : EXACT == EXACT_SAME ? first
                                        : first / 2,
                 line, raw);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec4 sums[3] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
        [[unroll]] for (int at = 0; at < KEPT; ++at) {
            uvec4 texel = EXACT != 0 ? raw[texel_in_run(i) + 1 - KEPT / 2 + at]
                                      : raw_pixel(source, read_shapes[0],
                                                  clamp(windows[i].first + at, 0, last), line);
            [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
                sums[kernel] += windows[i].weights[at][kernel] * seen(texel);
        }
        [[unroll]] for (int kept = KERNELS; kept < KEPT * KERNELS; ++kept)
            rows[kept - KERNELS][i] = rows[kept][i];
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            rows[(KEPT - 1) * KERNELS + kernel][i] = sums[kernel];
    }
}

vec4 column_of(Window window, int i)
{
    vec4 sums[3] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
    [[unroll]] for (int row = 0; row < KEPT; ++row)
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            sums[kernel] += window.weights[row][kernel] * rows[row * KERNELS + kernel][i];
    return sum_of(sums);
}

void main()
{
    copy_shapes();
    ivec2 source_size = READ_SIZE(source, 1), size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(COLUMNS, WINDOW_ROWS));
    int end = min(first.y + WINDOW_ROWS, size.y);
    // The position as in place_in_size(), but with a rest in place of a quotient for each row.
    uint height = uint(source_size.y);
    uint divisor = 2u * uint(params.target_height);
    uint number = uint(2 * first.y + 1) * height + divisor / 2u;
    uint rest = number % divisor;
    int texel = int(number / divisor) - 1, row = texel - KEPT / 2;
    vec2 ratio = vec2(source_size.x, height) / vec2(params.target_width, params.target_height);
    float coarse = params.coarse, shares = params.divisor;
    uvec4 raw[COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        Place place = place_in_size(source_size, ivec2(first.x + i, 0), size);
        windows[i] = window_of(within_border(axis_x(place, source_size, ratio)), KEPT, true);
        raw[i] = uvec4(0);
        [[unroll]] for (int kept = 0; kept < KEPT * KERNELS; ++kept)
            rows[kept][i] = vec4(0.0);
    }
    for (int y = first.y; y < end;) {
        // A position has at least one new row if the target is not higher than the source. llvmpipe runs
        // what a loop contains once more than it must if the condition comes first.
        do
            add_row(++row, first.x);
        while (row < texel + KEPT / 2);
        // If it is not smaller, a row has at least one position.
        do {
            Axis axis = within_border(
                Axis(texel, float(rest) / float(divisor), source_size.y, ratio.y));
            Window window = window_of(axis, KEPT, false);
            if (HAS_OWN)
                load_own(first.x, y, raw);
            [[unroll]] for (int i = 0; i < COLUMNS; ++i)
                raw[i] = shade(raw[i], coarse * (column_of(window, i) / shares), ivec2(first.x + i, y));
            store(first.x, y, raw);
            rest += 2u * height;
            ++y;
        } while (ENLARGED != 0 && rest < divisor && y < end);
        uint moved = rest / divisor;
        rest -= moved * divisor;
        texel += int(moved);
    }
}
