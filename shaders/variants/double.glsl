// Upsampling to exactly twice the size. An invocation writes a strip from top to bottom and loads
// each texel once. `Pyramid(levels=5)` takes 47 ms, and 61 with
// the general strips (filter.glsl) (processor time of 1920 x
// 1080 in float16, lavapipe of Mesa 25.0.7, 2026-11-26). The including shader includes
// nested.glsl and defines LINEAR_COLUMNS.
#include "lib/doubling.glsl"

const int COLUMNS = LINEAR_COLUMNS(CHANNEL_BYTES), ROWS = DOUBLE_LINEAR_ROWS;
// Columns of the smaller level that are loaded for a row. A pixel at an odd position starts one
// texel later.
const int LOADED = COLUMNS / 2 + 4;
const int KEPT = 5;

#define LOAD load_source
#define LOAD_IMAGE source
#define LOAD_NUMBER 1
#define LOAD_FROM -2
#define LOAD_COUNT LOADED
#include "variants/load.glsl"

#include "variants/own.glsl"

void main()
{
    copy_shapes();
    ivec2 last = READ_SIZE(source, 1) - 1, size = TARGET_SIZE();
    ivec2 first = first_pixel(ivec2(COLUMNS, ROWS));
    int end = min(first.y + ROWS, size.y) / 2;
    vec4 rows[KEPT][COLUMNS];
    vec4 texels[LOADED];
    uvec4 raw[LOADED], pixels[COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    [[unroll]] for (int row = 0; row < KEPT; ++row)
        [[unroll]] for (int i = 0; i < COLUMNS; ++i)
            rows[row][i] = vec4(0.0);
    [[unroll]] for (int i = 0; i < COLUMNS; ++i)
        pixels[i] = uvec4(0);
    for (int y = first.y / 2 - 2; y < end + 2; ++y) {
        load_source(first.x / 2, clamp(y, 0, last.y), raw);
        [[unroll]] for (int i = 0; i < LOADED; ++i)
            texels[i] = value_of(raw[i]);
        [[unroll]] for (int row = 1; row < KEPT; ++row)
            [[unroll]] for (int i = 0; i < COLUMNS; ++i)
                rows[row - 1][i] = rows[row][i];
        [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
            int at = (i + 1) / 2;
            rows[KEPT - 1][i] = four(texels[at], texels[at + 1], texels[at + 2], texels[at + 3],
                                     (i & 1) == 1);
        }
        if (y < first.y / 2 + 2)
            continue;
        [[unroll]] for (int part = 0; part < 2; ++part) {
            int line = 2 * (y - 2) + part;
            if (HAS_OWN)
                load_own(first.x, line, pixels);
            [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
                vec4 sum = four(rows[part][i], rows[part + 1][i], rows[part + 2][i],
                                rows[part + 3][i], part == 1);
                pixels[i] = shade(pixels[i], params.coarse * sum, ivec2(first.x + i, line));
            }
            store(first.x, line, pixels);
        }
    }
}
