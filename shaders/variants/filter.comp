#pragma compile FINAL
// A filter of an image of any size in strips. An invocation writes a strip from top to bottom. It filters
// each row of the source along the row once, for each kernel, and keeps the filtered rows that a pixel
// needs. Where the sizes of the images along an axis are in a simple ratio (EXACT, EXACT_ROWS), positions have one
// or two PHASES, whose weights are computed once.
#include "variants/nested.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = WINDOW_COLUMNS(CHANNEL_BYTES), ROWS = WINDOW_ROWS;
// The rows and columns that a pixel needs. At HDRP's border their place differs from the position's.
const int KEPT = IS_INSET ? WINDOW + 2 : WINDOW;

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, source);
READ_IMAGE(2, own);

#define LOAD load_own
#define LOAD_IMAGE own
#define LOAD_NUMBER 2
#include "variants/load.glsl"

// The texels of a row are a run where the ratio of widths is simple. The compiler removes loads that no window needs.
const int BEFORE = MAX_WINDOW / 2, LOADED = 2 * COLUMNS + MAX_WINDOW;
#define LOAD load_run
#define LOAD_FROM (-MAX_WINDOW / 2)
#define LOAD_COUNT LOADED
#include "variants/load.glsl"

#ifdef FINAL
#define ENDED_BINDING 3
#include "lib/ended.glsl"
#define HAS_OWN true
#else
#define HAS_OWN (ADD_OWN != 0)
#endif
#include "variants/store.glsl"

// What becomes of a filtered pixel.
uvec4 shade(uvec4 own_pixel, vec4 sum, ivec2 pixel)
{
#ifdef FINAL
    return ended(own_pixel, as_stored(sum, FORMAT), pixel);
#else
    if (ADD_OWN != 0)
        sum += params.own * value_of(own_pixel);
    return buffer_of(sum);
#endif
}

// Windows whose weights depend on the place, too, are computed for each column.
const bool HAS_BORDER = IS_INSET || UPSAMPLE == UPSAMPLE_INSIDE;
const int PHASES = EXACT == 0 ? COLUMNS : HAS_BORDER ? COLUMNS : EXACT == EXACT_DOUBLE ? 2 : 1;
// The rows of the source and of the target that are next to each other in the same way again.
const int ROWS_IN = EXACT_ROWS == EXACT_HALF ? 2 : 1, ROWS_OUT = EXACT_ROWS == EXACT_DOUBLE ? 2 : 1;
// Where a row of the source is in fewer windows than a window has rows, the sums of these windows are kept in
// place of filtered rows.
const bool KEEPS_SUMS = EXACT_ROWS == EXACT_HALF;
const int KEPT_ROWS = KEEPS_SUMS ? KEPT / 2 : KEPT + ROWS_OUT - 1;

Window windows[PHASES];
// (A constant that is given at random may be 0, an array's length not.)
vec4 rows[KEPT_ROWS * KERNELS > 0 ? KEPT_ROWS * KERNELS : 1][COLUMNS];

// The texel at or before the position of a column, in texels of the run.
int texel_in_run(int column)
{
    return BEFORE
         + (EXACT == EXACT_HALF       ? 2 * column
                : EXACT == EXACT_SAME ? column
                                       : (column + 1) / 2 - 1);
}

// The new row, for each kernel.
vec4 filtered[3][COLUMNS];

void filter_row(int row, int first)
{
    ivec2 last = READ_SIZE(source, 1) - 1;
    int line = clamp(row, 0, last.y);
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
                                      : raw_pixel(source, read_shapes[0], clamp(windows[i % PHASES].first + at, 0, last.x),
                                                  line);
            [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
                if (has_weight(TAKEN_X, at, kernel))
                    sums[kernel] += windows[i % PHASES].weights[at][kernel] * seen(value_of(texel));
        }
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            filtered[kernel][i] = sums[kernel];
    }
}

void move_rows()
{
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        [[unroll]] for (int kept = KERNELS; kept < KEPT_ROWS * KERNELS; ++kept)
            rows[kept - KERNELS][i] = rows[kept][i];
}

void keep_row()
{
    move_rows();
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            rows[(KEPT_ROWS - 1) * KERNELS + kernel][i] = filtered[kernel][i];
}

// Adds the new row, one of two, to the sums of the windows that it is part of.
void add_to_sums(Window window, int number)
{
    [[unroll]] for (int kept = 0; kept < KEPT_ROWS; ++kept)
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel) {
            int at = KEPT - 2 - 2 * kept + number;
            if (has_weight(TAKEN_Y, at, kernel))
                [[unroll]] for (int i = 0; i < COLUMNS; ++i)
                    rows[kept * KERNELS + kernel][i] += window.weights[at][kernel] * filtered[kernel][i];
        }
}

// Ends the first sums, and begins new ones.
void begin_sums()
{
    move_rows();
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            rows[(KEPT_ROWS - 1) * KERNELS + kernel][i] = vec4(0.0);
}

// A pixel from the rows that are kept, from `start` on.
vec4 column_of(Window window, int start, int i)
{
    vec4 sums[3] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
    [[unroll]] for (int row = 0; row < (KEEPS_SUMS ? 1 : KEPT); ++row)
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel) {
            vec4 kept = rows[(start + row) * KERNELS + kernel][i];
            if (KEEPS_SUMS)
                sums[kernel] = kept;
            else if (has_weight(TAKEN_Y, row, kernel))
                sums[kernel] += window.weights[row][kernel] * kept;
        }
    return sum_of(sums);
}

void write_row(int first, int y, Window window, int start, float coarse, float shares)
{
    uvec4 raw[COLUMNS];

    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        raw[i] = uvec4(0);
    if (HAS_OWN)
        load_own(first, y, raw);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        raw[i] = shade(raw[i], coarse * (column_of(window, start, i) / shares), ivec2(first + i, y));
    store(first, y, raw);
}

void write_in_phases(ivec2 first, int end, vec2 ratio)
{
    ivec2 source_size = READ_SIZE(source, 1);
    float coarse = params.coarse, shares = params.divisor;
    Window phases[ROWS_OUT];

    [[unroll]] for (int i = 0; i < ROWS_OUT; ++i)
        phases[i] = window_of(axis_y(place_in_size(source_size, ivec2(0, i), TARGET_SIZE()), source_size, ratio),
                              KEPT, false);
    int start = first.y / ROWS_OUT;
    for (int y = start - KEPT_ROWS + 1; y < end / ROWS_OUT; ++y) {
        if (KEEPS_SUMS)
            begin_sums();
        [[unroll]] for (int i = 0; i < ROWS_IN; ++i) {
            filter_row(ROWS_IN * (y - 1) + KEPT / 2 + 1 + i, first.x);
            if (KEEPS_SUMS)
                add_to_sums(phases[0], i);
            else
                keep_row();
        }
        if (y < start)
            continue;
        [[unroll]] for (int i = 0; i < ROWS_OUT; ++i)
            write_row(first.x, ROWS_OUT * y + i, phases[i], i, coarse, shares);
    }
}

void write_strip(ivec2 first, int end, vec2 ratio)
{
    // The position as in place_in_size(), but with a rest in place of a quotient for each row.
    uint height = uint(READ_SIZE(source, 1).y);
    uint divisor = 2u * uint(params.target_height);
    uint number = uint(2 * first.y + 1) * height + divisor / 2u;
    uint rest = number % divisor;
    int texel = int(number / divisor) - 1, row = texel - KEPT / 2;
    float coarse = params.coarse, shares = params.divisor;

    for (int y = first.y; y < end;) {
        // A position has at least one new row if the target is not higher than the source. llvmpipe runs
        // what a loop contains once more than it must if the condition comes first.
        do {
            filter_row(++row, first.x);
            keep_row();
        } while (row < texel + KEPT / 2);
        // If it is not smaller, a row has at least one position.
        do {
            Axis axis = within_border(
                Axis(texel, float(rest) / float(divisor), int(height), ratio.y));
            write_row(first.x, y, window_of(axis, KEPT, false), 0, coarse, shares);
            rest += 2u * height;
            ++y;
        } while (ENLARGED != 0 && rest < divisor && y < end);
        uint moved = rest / divisor;
        rest -= moved * divisor;
        texel += int(moved);
    }
}

void main()
{
    copy_shapes();
    ivec2 source_size = READ_SIZE(source, 1), size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(COLUMNS, ROWS));
    int end = min(first.y + ROWS, size.y);
    vec2 ratio = vec2(source_size) / vec2(params.target_width, params.target_height);

    if (any(greaterThanEqual(first, size)))
        return;
    [[unroll]] for (int i = 0; i < PHASES; ++i) {
        Place place = place_in_size(source_size, ivec2(first.x + i, 0), size);
        windows[i] = window_of(within_border(axis_x(place, source_size, ratio)), KEPT, true);
    }
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        [[unroll]] for (int kept = 0; kept < KEPT_ROWS * KERNELS; ++kept)
            rows[kept][i] = vec4(0.0);
    if (EXACT_ROWS != 0)
        write_in_phases(first, end, ratio);
    else
        write_strip(first, end, ratio);
}
