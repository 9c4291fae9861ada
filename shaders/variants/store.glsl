// Defines the function that stores STORE_COUNT pixels to a row of the target. Pixels have
// TARGET_CHANNELS channels (4 in a storage image). With four channels the pixels are a multiple of 16
// bytes, with three of 24.

#ifdef WORDS
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
        words_of_target.runs[at] = u64vec2(eighth(part[0]), eighth(part[1]));
    else if (count == 3)
        triples_of_target.runs[at] = u64vec3(eighth(part[0]), eighth(part[1]), eighth(part[2]));
    else
        pairs_of_target.runs[at] =
            u64vec4(eighth(part[0]), eighth(part[1]), eighth(part[2]), eighth(part[3]));
}
#endif

void store(int first, int row, uvec4 raw[STORE_COUNT])
{
#ifdef WORDS
    const int BYTES = TARGET_CHANNELS * CHANNEL_BYTES;
    // 64-bit integers of a run. Rows of three channels have multiples of three, others of four.
    const int RUN = TARGET_CHANNELS == 3 ? 3 : STORE_COUNT * BYTES % 32 == 0 ? 4 : 2;
    const int COUNT = STORE_COUNT * BYTES / (8 * RUN);
    const uint PIXELS = 8 * RUN / BYTES;
    int start = int(uint(first) / PIXELS), last = int(uint(target_shape.x - 1) / PIXELS);
    int row_start = (row - target_shape.w) * (2 * target_shape.z / RUN);
    [[unroll]] for (int i = 0; i < COUNT; ++i) {
        uvec2 part[4];
        [[unroll]] for (int j = 0; j < RUN; ++j)
            part[j] = uvec2(quarter_of(raw, 2 * (RUN * i + j)),
                            quarter_of(raw, 2 * (RUN * i + j) + 1));
        // The first pixel is inside of the image.
        if (i == 0 || start + i <= last)
            store_run(row_start + start + i, RUN, part);
    }
#else
    [[unroll]] for (int i = 0; i < STORE_COUNT; ++i) {
        ivec2 pixel = ivec2(first + i, row);
        if (pixel.x < imageSize(target).x)
            imageStore(target, pixel, uintBitsToFloat(raw[i]));
    }
#endif
}
