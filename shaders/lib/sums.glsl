// Adds up the values of pixels, or their squares, in blocks of SUM_SIDE x SUM_SIDE, always in the same
// order.

#define SUM_OF_BLOCK(value) \
    vec4 sum_of_block(ivec2 size) \
    { \
        ivec2 first = PIXEL * SUM_SIDE, end = min(first + SUM_SIDE, size); \
        vec4 sum = vec4(0.0); \
        for (int y = first.y; y < end.y; ++y) { \
            vec4 row = vec4(0.0); \
            for (int x = first.x; x < end.x; ++x) { \
                vec4 part = value(ivec2(x, y)); \
                row += BY == BY_SQUARES ? part * part : part; \
            } \
            sum += row; \
        } \
        return sum; \
    }
