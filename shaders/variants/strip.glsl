// A symmetric kernel along columns and rows, in strips: an invocation writes some rows from left to right.
// It adds up the columns of a run for all rows, adds these sums to the pixels near them, which it keeps in
// registers, and stores the pixels of two runs at once. The including shader defines STRIP_CHANNELS, the
// channels of the source in memory, and the functions below.

// A run of a row: a word, or three words with the pixels of three channels.
#if STRIP_CHANNELS == 3
const int RUN_WORDS = 3, COLUMNS = 4;
#else
const int RUN_WORDS = 1, COLUMNS = 4 / CHANNEL_BYTES;
#endif
const int COLUMNS_SHIFT = COLUMNS >> 1;  // the logarithm
const int ROWS = STRIP_ROWS(CHANNEL_BYTES), LOADED = ROWS + 2 * STRIP_RADIUS;
const int KEPT = 2 * STRIP_RADIUS, TAPS = KEPT + 1;
const int WAITING = STRIP_RADIUS / COLUMNS;
const int RUNS_AT_ONCE = 2, STEP = RUNS_AT_ONCE * COLUMNS;
// Runs of each row that are loaded before the first of them is used: llvmpipe calls a function for
// each load, before which it moves what is in registers to memory.
const int AHEAD = CHANNEL_BYTES == 4 ? 1 : 2;

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, source);
#define STORE_COUNT STEP
#include "variants/store.glsl"

int rows[LOADED];
// Of each row: the blooms that lack later columns, and the runs that they belong to.
vec3 kept[ROWS][KEPT];
uvec4 waiting[ROWS][WAITING + 1][RUN_WORDS];

// Defined by the including shader: what it computes at the start, and before the columns from x on; the
// weights of a row's taps, from the uppermost texel on, and those of a run's column, to the pixels from the
// leftmost one on; what changes in a loaded run; what is added of a pixel, and kept of a sum; the sums of
// columns outside of the image, where x is the first one of the run `at` or beyond it; and the pixel that
// is stored.
void start_weights(ivec2 first, ivec2 size);
void start_columns(int x, int width);
float row_weight(int row, int tap);
float column_weight(int column, int tap);
void change_run(int loaded, int at, inout uvec4 run[RUN_WORDS]);
vec3 added_of(uvec4 raw);
vec3 kept_of(vec3 sum);
void end_columns(int x, int at, int width, inout vec3 sums[ROWS][COLUMNS]);
uvec4 finished_pixel(uvec4 raw, vec3 sum, ivec2 pixel);

void start_row_sums(ivec2 first, ivec2 size)
{
    start_weights(first, size);
    [[unroll]] for (int i = 0; i < LOADED; ++i)
        rows[i] = clamp(first.y - STRIP_RADIUS + i, 0, size.y - 1) * read_shapes[0].z;
    [[unroll]] for (int row = 0; row < ROWS; ++row) {
        [[unroll]] for (int i = 0; i < KEPT; ++i)
            kept[row][i] = vec3(0.0);
        [[unroll]] for (int i = 0; i < WAITING; ++i)
            [[unroll]] for (int word = 0; word < RUN_WORDS; ++word)
                waiting[row][i][word] = uvec4(0);
    }
}

void pixels_of(uvec4 run[RUN_WORDS], out uvec4 raw[COLUMNS])
{
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
#if STRIP_CHANNELS == 3
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

void load_columns(int at, out uvec4 loaded[LOADED][RUN_WORDS])
{
    [[unroll]] for (int i = 0; i < LOADED; ++i) {
        [[unroll]] for (int word = 0; word < RUN_WORDS; ++word)
            loaded[i][word] = texelFetch(source, rows[i] + at * RUN_WORDS + word);
        change_run(i, at, loaded[i]);
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
            vec3 added = added_of(raw[i]);
            // (A loop over the rows of this tap alone has no constant ends, so it is not unrolled.)
            [[unroll]] for (int row = 0; row < ROWS; ++row)
                if (row == loaded)
                    sums[row][i] = row_weight(row, 0) * added;
                else if (row < loaded && loaded <= row + 2 * STRIP_RADIUS)
                    sums[row][i] += row_weight(row, loaded - row) * added;
        }
    }
    [[unroll]] for (int row = 0; row < ROWS; ++row)
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            sums[row][i] = kept_of(sums[row][i]);
}

// Adds a run's columns to the row, which finishes the pixels of the run STRIP_RADIUS before.
void finish_row(int row, ivec2 first, vec3 sums[COLUMNS], out uvec4 raw[COLUMNS])
{
    pixels_of(waiting[row][0], raw);
    [[unroll]] for (int i = 0; i < WAITING; ++i)
        waiting[row][i] = waiting[row][i + 1];
    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        vec3 sum = kept[row][0] + column_weight(i, 0) * sums[i];
        [[unroll]] for (int tap = 1; tap < KEPT; ++tap)
            kept[row][tap - 1] = kept[row][tap] + column_weight(i, tap) * sums[i];
        kept[row][KEPT - 1] = vec3(0.0) + column_weight(i, KEPT) * sums[i];
        raw[i] = finished_pixel(raw[i], sum, first + ivec2(i, 0));
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

// The first pixel of this invocation. The strips of a workgroup are below or beside each other.
ivec2 first_of_strip()
{
    if (DIRECTION == DIRECTION_HORIZONTAL)
        return first_pixel(ivec2(params.columns, ROWS));
    int below = int(gl_WorkGroupID.y * ROW_INVOCATIONS + gl_LocalInvocationID.x);
    return ivec2(int(gl_WorkGroupID.x) * params.columns, below * ROWS + target_shape.w);
}

void main()
{
    copy_shapes();
    ivec2 size = READ_SIZE(source, 1);
    ivec2 first = first_of_strip();
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
                    load_columns(run_of(x + start + i * COLUMNS, size.x), loaded[run + i]);
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
