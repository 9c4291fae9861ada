// Defines the function that stores a run of STORE_COUNT pixels to a row of the target. The run is a
// multiple of 16 bytes. Pixels have TARGET_CHANNELS channels (4 in a storage image).

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
#endif

void store(int first, int row, uvec4 raw[STORE_COUNT])
{
#ifdef WORDS
    const int BYTES = TARGET_CHANNELS * CHANNEL_BYTES;
    const int COUNT = STORE_COUNT * BYTES / 16;
    int start = first * BYTES / 16;
    int last = (target_shape.x * BYTES - 1) / 16;
    int row_start = (row - target_shape.w) * target_shape.z;
    [[unroll]] for (int i = 0; i < COUNT; ++i) {
        uvec4 word;
        [[unroll]] for (int j = 0; j < 4; ++j)
            word[j] = quarter_of(raw, 4 * i + j);
        // Without the maximum, LLVM packs lane by lane in the loop that stores.
        if (start + i <= last)
            target.row_words[row_start + start + i] = max(word, uvec4(unknown_zero));
    }
#else
    [[unroll]] for (int i = 0; i < STORE_COUNT; ++i) {
        ivec2 pixel = ivec2(first + i, row);
        if (pixel.x < imageSize(target).x)
            imageStore(target, pixel, uintBitsToFloat(raw[i]));
    }
#endif
}
