// The complete bloom of an image for devices without fast shared memory, or its transpose (fused_bloom.glsl), in strips:
// an invocation writes some rows from left to right. It adds up the columns of a run for all rows, adds these sums to the
// pixels near them, which it keeps in registers, and stores the pixels of two runs at once. Without it `Separable` takes
// 36 ms in place of 15, with Mesa 25.0.7 39 in place of 13 (processor time of 1920 x 1080 in float16, lavapipe of Mesa
// 22.3.6, 2026-11-28). Backwards it takes 10 ms, and 23 with a pass for each axis and the threshold (960 x 544 in
// float32, 2026-11-26).
#include "variants/pixels.glsl"
#include "variants/fused_bloom.glsl"

// A run of a row: a word, or three words with the pixels of three channels.
#if SOURCE_CHANNELS == 3
const int RUN_WORDS = 3, COLUMNS = 4;
#else
const int RUN_WORDS = 1, COLUMNS = 4 / CHANNEL_BYTES;
#endif
const int COLUMNS_SHIFT = COLUMNS >> 1;  // the logarithm
const int ROWS = STRIP_ROWS, LOADED = ROWS + 2 * STRIP_RADIUS;
const int KEPT = 2 * STRIP_RADIUS, LINE_TAPS = KEPT + 1;
const int WAITING = STRIP_RADIUS / COLUMNS;
const int RUNS_AT_ONCE = 2, STEP = RUNS_AT_ONCE * COLUMNS;
// Runs of each row that are loaded before the first of them is used: llvmpipe calls a function for
// each load, before which it moves what is in registers to memory.
const int AHEAD = CHANNEL_BYTES == 4 ? 1 : 2;

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(SLOT_SOURCE, source);
#define STORE_COUNT STEP
#include "variants/store.glsl"

int rows[LOADED];
// Of each row: the blooms that lack later columns, and the runs that they belong to.
vec3 unfinished[ROWS][KEPT];
uvec4 waiting[ROWS][WAITING + 1][RUN_WORDS];

// Of columns and of rows: the weights of a tap and of all taps beyond it.
float weights[2][STRIP_RADIUS + 1], beyond[2][STRIP_RADIUS + 1];
// The weights of a row's taps, from the uppermost texel on, and those of a run's column, to the pixels from the leftmost
// one on.
float row_weights[ROWS][LINE_TAPS], column_weights[COLUMNS][LINE_TAPS];

// The weight of a texel for the pixel `tap` before it.
float weight_of(bool vertical, int texel, int tap, int size)
{
    int axis = int(vertical), pixel = texel - tap;
    float weight = weights[axis][abs(tap)];
    if (TRANSPOSED == 0)
        return weight;
    if (tap >= 0)
        weight += pixel == 0 ? beyond[axis][abs(tap)] : 0.0;
    if (tap <= 0)
        weight += pixel == size - 1 ? beyond[axis][abs(tap)] : 0.0;
    return texel >= 0 && texel < size ? weight : 0.0;
}

void start_weights(ivec2 first, ivec2 size)
{
    [[unroll]] for (int axis = 0; axis < 2; ++axis)
        [[unroll]] for (int i = 0; i <= STRIP_RADIUS; ++i) {
            weights[axis][i] = kernel_weight(axis == 1, i);
            beyond[axis][i] = TRANSPOSED != 0 ? weight_beyond(axis == 1, i, STRIP_RADIUS) : 0.0;
        }
    [[unroll]] for (int row = 0; row < ROWS; ++row)
        [[unroll]] for (int tap = 0; tap < LINE_TAPS; ++tap) {
            int from = tap - STRIP_RADIUS;
            row_weights[row][tap] = weight_of(true, first.y + row + from, from, size.y);
        }
}

void start_columns(int x, int width)
{
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        [[unroll]] for (int tap = 0; tap < LINE_TAPS; ++tap)
            column_weights[i][tap] = weight_of(false, x + i, STRIP_RADIUS - tap, width);
}

// Replaces sums outside of the image by those of its outermost columns, where x is the first column of the run `at` or
// beyond it. Of the transpose they have no weight.
void end_columns(int x, int at, int width, inout vec3 sums[ROWS][COLUMNS])
{
    if (TRANSPOSED != 0)
        return;
    [[unroll]] for (int row = 0; row < ROWS; ++row) {
        [[unroll]] for (int i = 1; i < COLUMNS; ++i)
            sums[row][i] = at * COLUMNS + i >= width ? sums[row][i - 1] : sums[row][i];
        [[unroll]] for (int i = 0; i < COLUMNS - 1; ++i)
            sums[row][i] = x > at * COLUMNS ? sums[row][COLUMNS - 1] : sums[row][i];
        [[unroll]] for (int i = 1; i < COLUMNS; ++i)
            sums[row][i] = x < 0 ? sums[row][0] : sums[row][i];
    }
}

void start_row_sums(ivec2 first, ivec2 size)
{
    start_weights(first, size);
    [[unroll]] for (int i = 0; i < LOADED; ++i)
        rows[i] = clamp(first.y - STRIP_RADIUS + i, 0, size.y - 1) * read_shapes[SLOT_SOURCE].z;
    [[unroll]] for (int row = 0; row < ROWS; ++row) {
        [[unroll]] for (int i = 0; i < KEPT; ++i)
            unfinished[row][i] = vec3(0.0);
        [[unroll]] for (int i = 0; i < WAITING; ++i)
            [[unroll]] for (int word = 0; word < RUN_WORDS; ++word)
                waiting[row][i][word] = uvec4(0);
    }
}

void pixels_of(uvec4 run[RUN_WORDS], out uvec4 raw[COLUMNS])
{
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
#if SOURCE_CHANNELS == 3
        int at = 3 * i;
        raw[i] = uvec4(run[at / 4][at % 4], run[(at + 1) / 4][(at + 1) % 4],
                       run[(at + 2) / 4][(at + 2) % 4], 0);
#elif CHANNEL_BYTES == 4
        raw[i] = run[0];
#elif CHANNEL_BYTES == 2
        raw[i] = uvec4(run[0][2 * i], run[0][2 * i + 1], 0, 0);
#else
        raw[i] = uvec4(run[0][i], 0, 0, 0);
#endif
    }
}

void load_columns(int at, int top, out uvec4 loaded[LOADED][RUN_WORDS])
{
    [[unroll]] for (int i = 0; i < LOADED; ++i) {
        [[unroll]] for (int word = 0; word < RUN_WORDS; ++word)
            loaded[i][word] = texelFetch(source, rows[i] + at * RUN_WORDS + word);
#if TRANSPOSED
        if (FINITE == 0)
            loaded[i][0] = floatBitsToUint(where_finite(uintBitsToFloat(loaded[i][0]), other_at(ivec2(at, top + i))));
#endif
    }
}

// Sums of the columns of a run for all rows.
void add_columns(uvec4 runs[LOADED][RUN_WORDS], out vec3 sums[ROWS][COLUMNS])
{
    [[unroll]] for (int loaded = 0; loaded < LOADED; ++loaded) {
        uvec4 raw[COLUMNS];
        pixels_of(runs[loaded], raw);
        if (loaded >= STRIP_RADIUS && loaded < ROWS + STRIP_RADIUS)
            waiting[loaded - STRIP_RADIUS][WAITING] = runs[loaded];
        [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
            vec3 value = value_of(raw[i]).rgb, added = TRANSPOSED != 0 ? value : thresholded(value);
            // (A loop over the rows of this tap alone has no constant ends, so it is not unrolled.)
            [[unroll]] for (int row = 0; row < ROWS; ++row)
                if (row == loaded)
                    sums[row][i] = row_weights[row][0] * added;
                else if (row < loaded && loaded <= row + 2 * STRIP_RADIUS)
                    sums[row][i] += row_weights[row][loaded - row] * added;
        }
    }
    [[unroll]] for (int row = 0; row < ROWS; ++row)
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            sums[row][i] = kept(sums[row][i]);
}

// Adds a run's columns to the row, which finishes the pixels of the run STRIP_RADIUS before.
void finish_row(int row, ivec2 first, vec3 sums[COLUMNS], out uvec4 raw[COLUMNS])
{
    pixels_of(waiting[row][0], raw);
    [[unroll]] for (int i = 0; i < WAITING; ++i)
        waiting[row][i] = waiting[row][i + 1];
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec3 sum = unfinished[row][0] + column_weights[i][0] * sums[i];
        [[unroll]] for (int tap = 1; tap < KEPT; ++tap)
            unfinished[row][tap - 1] = unfinished[row][tap] + column_weights[i][tap] * sums[i];
        unfinished[row][KEPT - 1] = vec3(0.0) + column_weights[i][KEPT] * sums[i];
        raw[i] = ended(raw[i], vec4(kept(sum), 1.0), first + ivec2(i, 0));
    }
}

// The run of the column x, or the nearest one in the image.
int run_of(int x, int width)
{
    return clamp(x >> COLUMNS_SHIFT, 0, (width - 1) >> COLUMNS_SHIFT);
}

// Adds the run of the column x to all rows. The pixels from `done` on are finished then.
void add_run(int x, uvec4 loaded[LOADED][RUN_WORDS], ivec2 done, int width,
             out uvec4 raw[ROWS][COLUMNS])
{
    vec3 sums[ROWS][COLUMNS];

    start_columns(x, width);
    add_columns(loaded, sums);
    end_columns(x, run_of(x, width), width, sums);
    [[unroll]] for (int row = 0; row < ROWS; ++row)
        finish_row(row, done + ivec2(0, row), sums[row], raw[row]);
}

void main()
{
    copy_shapes();
    ivec2 size = READ_SIZE(SLOT_SOURCE);
    ivec2 first = first_pixel(ivec2(params.columns, ROWS));
    int end = min(first.x + params.columns, size.x);

    if (any(greaterThanEqual(first, size)))
        return;
    start_row_sums(first, size);
    for (int x = first.x - STRIP_RADIUS; x < end + STRIP_RADIUS; x += STEP) {
        uvec4 loaded[RUNS_AT_ONCE][LOADED][RUN_WORDS], added[ROWS][COLUMNS], raw[ROWS][STEP];
        ivec2 done = ivec2(x - STRIP_RADIUS, first.y);
        // All pixels before the first store, after which compilers load parameters lane by lane.
        [[unroll]] for (int run = 0; run < RUNS_AT_ONCE; ++run) {
            int start = run * COLUMNS;
            if (run % AHEAD == 0)
                [[unroll]] for (int i = 0; i < AHEAD; ++i)
                    load_columns(run_of(x + start + i * COLUMNS, size.x), first.y - STRIP_RADIUS, loaded[run + i]);
            add_run(x + start, loaded[run], done + ivec2(start, 0), size.x, added);
            [[unroll]] for (int row = 0; row < ROWS; ++row)
                [[unroll]] for (int i = 0; i < COLUMNS; ++i)
                    raw[row][start + i] = added[row][i];
        }
        if (done.x < first.x)
            continue;
        // Each run follows from the one above. If it were computed from its row, LLVM would do so for
        // each invocation on its own, in the loop that stores.
        int at = run_at(done.x, done.y);
        [[unroll]] for (int row = 0; row < ROWS; ++row) {
            if (done.y + row < size.y)
                store_at(at, done.x, raw[row]);
            at += runs_in_row();
        }
    }
}
