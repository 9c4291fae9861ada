// A filter of an image of any size (variants/kept_rows.glsl): each row of the source is filtered along the row once, for
// each kernel. Where the widths are in a simple ratio (EXACT), columns share loads and the weights of one or two
// PHASES. Without it `dual_kawase` takes 88 ms in place of 63 (processor time of 1920 x 1080 in float16, lavapipe of
// Mesa 22.3.6, 2026-11-27).
#include "variants/nested.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = WINDOW_COLUMNS(CHANNEL_BYTES), ROWS = WINDOW_ROWS;
// The rows and columns that a pixel needs. At HDRP's border their place differs from the position's.
const int KEPT = IS_INSET ? WINDOW + 2 : WINDOW;

READ_IMAGE(SLOT_SOURCE, source);
READ_IMAGE(SLOT_SAME_SIZE, same_size);
#ifdef FINAL
READ_IMAGE(SLOT_ENDED, scene);
#endif

// The texels of a row are a run where the ratio of widths is simple. The compiler removes loads that no window needs.
const int BEFORE = MAX_WINDOW / 2, LOADED = 2 * COLUMNS + MAX_WINDOW;
#define LOAD load_run
#define LOAD_FROM (-MAX_WINDOW / 2)
#define LOAD_COUNT LOADED
#include "variants/load.glsl"

#ifdef FINAL
#include "lib/ended.glsl"
#endif
#include "variants/store.glsl"

// What is added to a pixel of the target: of a bloom the scene.
uvec4 added_in_run(int first, int i, int y)
{
#ifdef FINAL
    return raw_in_run(scene, read_shapes[SLOT_ENDED], first, i, y);
#else
    return ADDS_IMAGE != 0 ? raw_in_run(same_size, read_shapes[SLOT_SAME_SIZE], first, i, y) : uvec4(0);
#endif
}

// What becomes of a filtered pixel.
uvec4 shade(uvec4 own, vec4 sum, ivec2 pixel)
{
#ifdef FINAL
    if (ADDS_IMAGE != 0)
        sum += params.same_size * value_of(raw_pixel(same_size, read_shapes[SLOT_SAME_SIZE], pixel.x, pixel.y));
    return ended(own, as_stored(sum, FORMAT), pixel);
#else
    if (ADDS_IMAGE != 0)
        sum += params.same_size * value_of(own);
    return buffer_of(sum);
#endif
}

// Windows whose weights depend on the place, too, are computed for each column.
const bool HAS_BORDER = IS_INSET || UPSAMPLE == UPSAMPLE_INSIDE;
const int ROW_PHASES = EXACT_ROWS == EXACT_DOUBLE ? 2 : 1;
const int PHASES = EXACT == 0 ? COLUMNS : HAS_BORDER ? COLUMNS : EXACT == EXACT_DOUBLE ? 2 : 1;
Window windows[PHASES], row_windows[ROW_PHASES];
vec2 ratio;
float coarse, shares;
// (A constant that is given at random may be 0, an array's length not.)
vec4 rows[KEPT * KERNELS > 0 ? KEPT * KERNELS : 1][COLUMNS];

// The first texel of a column's window, from the first column's position on.
int first_in_run(int column)
{
    return WINDOW_OFFSET(EXACT, column) - KEPT / 2 + (EXACT == EXACT_DOUBLE ? 0 : 1);
}

void keep_row(int first, int row)
{
    ivec2 last = READ_SIZE(SLOT_SOURCE) - 1;
    int line = clamp(row + params.first_y, 0, last.y);
    uvec4 raw[LOADED];

    [[unroll]] for (int kept = KERNELS; kept < KEPT * KERNELS; ++kept)
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            rows[kept - KERNELS][i] = rows[kept][i];
    if (EXACT != 0)
        load_run(WINDOW_OFFSET(EXACT, first) + params.first_x, line, raw);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec4 sums[3] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
        [[unroll]] for (int at = 0; at < KEPT; ++at) {
            uvec4 texel = EXACT != 0 ? raw[BEFORE + first_in_run(i) + at]
                                      : raw_pixel(source, read_shapes[SLOT_SOURCE], clamp(windows[i % PHASES].first + at, 0, last.x),
                                                  line);
            [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
                if (has_weight(TAKEN_X, at, kernel))
                    sums[kernel] += windows[i % PHASES].weights[at][kernel] * seen(value_of(texel));
        }
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            rows[(KEPT - 1) * KERNELS + kernel][i] = sums[kernel];
    }
}

vec4 column_of(Window window, int i)
{
    vec4 sums[3] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
    [[unroll]] for (int row = 0; row < KEPT; ++row)
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            if (has_weight(TAKEN_Y, row, kernel))
                sums[kernel] += window.weights[row][kernel] * rows[row * KERNELS + kernel][i];
    return sum_of(sums);
}

void write_row(int first, int y, int texel, float part, int phase)
{
    Window window = row_windows[phase];
    if (EXACT_ROWS == 0)
        window = window_of(within_border(Axis(texel, part, READ_SIZE(SLOT_SOURCE).y, ratio.y)), KEPT, false);
    uvec4 raw[COLUMNS];

    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        raw[i] = added_in_run(first, i, y);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        raw[i] = shade(raw[i], coarse * (column_of(window, i) / shares), ivec2(first + i, y));
    store(first, y, raw);
}

void start_columns(ivec2 first)
{
    ivec2 source_size = READ_SIZE(SLOT_SOURCE);
    ratio = vec2(source_size) / vec2(params.target_width, params.target_height);
    coarse = params.coarse;
    shares = params.divisor;
    [[unroll]] for (int i = 0; i < PHASES; ++i) {
        Place place = position_of(source_size, ivec2(first.x + i, 0), TARGET_SIZE());
        windows[i] = window_of(within_border(axis_of(place, source_size, ratio, 0)), KEPT, true);
    }
    [[unroll]] for (int i = 0; i < ROW_PHASES; ++i) {
        Place place = position_of(source_size, ivec2(0, i), TARGET_SIZE());
        row_windows[i] = window_of(axis_of(place, source_size, ratio, 1), KEPT, false);
    }
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        [[unroll]] for (int kept = 0; kept < KEPT * KERNELS; ++kept)
            rows[kept][i] = vec4(0.0);
}

#include "variants/kept_rows.glsl"
