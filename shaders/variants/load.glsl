// Defines a function that loads a run of pixels of one row. Define before each inclusion:
//
//   LOAD           its name
//   LOAD_IMAGE     the image, and LOAD_SLOT its slot; default: `source`
//   LOAD_CHANNELS  the channels of its pixels in memory, 3 or 4 (default)
//   LOAD_FROM      the offset of the run from `first` in pixels, 0 (default) or less
//   LOAD_COUNT     the number of pixels in the run; default: COLUMNS
//
// `first` is at a multiple of 16 bytes. Outside of the image, the outermost pixels are repeated.
#ifndef LOAD_IMAGE
#define LOAD_IMAGE source
#define LOAD_SLOT SLOT_SOURCE
#endif
#ifndef LOAD_CHANNELS
#define LOAD_CHANNELS 4
#endif
#ifndef LOAD_FROM
#define LOAD_FROM 0
#endif
#ifndef LOAD_COUNT
#define LOAD_COUNT COLUMNS
#endif

void LOAD(int first, int row, out uvec4 raw[LOAD_COUNT])
{
    const int BYTES = LOAD_CHANNELS * CHANNEL_BYTES;
    const int BEFORE = (15 - LOAD_FROM * BYTES) / 16;
    const int COUNT = BEFORE + ((LOAD_FROM + LOAD_COUNT) * BYTES + 15) / 16;
    ivec4 shape = read_shapes[LOAD_SLOT];
    int last_word = (shape.x * BYTES - 1) / 16;
    uint packed[4 * COUNT + 1];
    [[unroll]] for (int i = 0; i < COUNT; ++i) {
        int at = clamp(first * BYTES / 16 - BEFORE + i, 0, last_word);
        uvec4 word = texelFetch(LOAD_IMAGE, row * shape.z + at);
        [[unroll]] for (int j = 0; j < 4; ++j)
            packed[4 * i + j] = word[j];
    }
    packed[4 * COUNT] = 0;
    [[unroll]] for (int i = 0; i < LOAD_COUNT; ++i) {
        int start = 16 * BEFORE + (LOAD_FROM + i) * BYTES;
        int at = start / 4;
#if CHANNEL_BYTES == 4
        raw[i] = uvec4(packed[at], packed[at + 1], packed[at + 2],
                       LOAD_CHANNELS == 4 ? packed[at + 3] : 0);
#elif CHANNEL_BYTES == 2
        raw[i] = (start & 2) == 0 ? uvec4(packed[at], packed[at + 1], 0, 0)
                                  : uvec4(packed[at] >> 16 | packed[at + 1] << 16,
                                          packed[at + 1] >> 16, 0, 0);
#else
        int offset = 8 * (start & 3);
        raw[i] = uvec4(packed[at] >> offset, 0, 0, 0);
        if (offset > 8)
            raw[i].x |= packed[at + 1] << (32 - offset);
#endif
    }
    // If a word is one pixel, its index is clamped already.
    if (BYTES == 16)
        return;
    [[unroll]] for (int i = -LOAD_FROM - 1; i >= 0; --i)
        raw[i] = first + LOAD_FROM + i < 0 ? raw[i + 1] : raw[i];
    [[unroll]] for (int i = 1; i < LOAD_COUNT; ++i)
        raw[i] = first + LOAD_FROM + i >= shape.x ? raw[i - 1] : raw[i];
}

#undef LOAD
#undef LOAD_IMAGE
#undef LOAD_SLOT
#undef LOAD_CHANNELS
#undef LOAD_FROM
#undef LOAD_COUNT
