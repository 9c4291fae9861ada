// Defines the function that stores STORE_COUNT pixels (by default COLUMNS) to a row of the target. Pixels have
// TARGET_CHANNELS channels. With four channels the pixels are a multiple of 16
// bytes, with three of 24.

#ifndef STORE_COUNT
#define STORE_COUNT COLUMNS
#endif

// Four bytes of the run in memory, from 4 * number on.
uint quarter_of(uvec4 raw[STORE_COUNT], int number)
{
    const int BYTES = TARGET_CHANNELS * CHANNEL_BYTES;
    // The pixel at which this quarter of a word begins, and the number of its bytes that the
    // previous quarter has.
    int pixel = 4 * number / BYTES, skipped = 4 * number % BYTES;
#if TARGET_CHANNELS * CHANNEL_BYTES == 3
    return (raw[pixel].x & 0xffffffu) >> 8 * skipped
         | raw[min(pixel + 1, STORE_COUNT - 1)].x << (24 - 8 * skipped);
#elif TARGET_CHANNELS * CHANNEL_BYTES == 6
    return skipped == 0   ? raw[pixel].x
         : skipped == 2 ? raw[pixel].x >> 16 | raw[pixel].y << 16
                        : (raw[pixel].y & 0xffffu) | raw[min(pixel + 1, STORE_COUNT - 1)].x << 16;
#else
    return raw[pixel][skipped / 4];
#endif
}

// Stores a run of `count` 64-bit integers.
void store_run(int at, int count, uvec2 part[4])
{
    if (count == 2)
        runs_of_target.runs[at] = u64vec2(eighth(part[0]), eighth(part[1]));
    else if (count == 3)
        triples_of_target.runs[at] = u64vec3(eighth(part[0]), eighth(part[1]), eighth(part[2]));
    else
        pairs_of_target.runs[at] =
            u64vec4(eighth(part[0]), eighth(part[1]), eighth(part[2]), eighth(part[3]));
}

// 64-bit integers of a run. Rows of three channels have multiples of three, others of four.
const int STORE_BYTES = TARGET_CHANNELS * CHANNEL_BYTES;
const int STORE_RUN = TARGET_CHANNELS == 3 ? 3 : STORE_COUNT * STORE_BYTES % 32 == 0 ? 4 : 2;
const uint STORE_PIXELS = 8 * STORE_RUN / STORE_BYTES;

int runs_in_row()
{
    return 2 * target_shape.z / STORE_RUN;
}

// The run that begins with this pixel.
int run_at(int first, int row)
{
    return (row - target_shape.w) * runs_in_row() + int(uint(first) / STORE_PIXELS);
}

// Stores the pixels of a row from `first` on, which are in the runs from `at` on.
void store_at(int at, int first, uvec4 raw[STORE_COUNT])
{
    const int COUNT = STORE_COUNT * STORE_BYTES / (8 * STORE_RUN);
    int start = int(uint(first) / STORE_PIXELS);
    int last = int(uint(target_shape.x - 1) / STORE_PIXELS);
    [[unroll]] for (int i = 0; i < COUNT; ++i) {
        uvec2 part[4];
        [[unroll]] for (int j = 0; j < STORE_RUN; ++j)
            part[j] = uvec2(quarter_of(raw, 2 * (STORE_RUN * i + j)),
                            quarter_of(raw, 2 * (STORE_RUN * i + j) + 1));
        // The first pixel is inside of the image.
        if (i == 0 || start + i <= last)
            store_run(at + i, STORE_RUN, part);
    }
}

void store(int first, int row, uvec4 raw[STORE_COUNT])
{
    store_at(run_at(first, row), first, raw);
}
