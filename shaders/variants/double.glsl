// From a level to one of exactly twice its size. An invocation walks down a strip and loads each
// texel once. A shader that includes this has `smaller`, `target`, and what a pixel makes of its sum.
#include "lib/doubling.glsl"

vec4 shade(ivec2 pixel, vec4 sum);

// Texels of the smaller level, columns and rows; a pixel of an odd place starts one texel later.
const int LOADED = DOUBLE_COLUMNS / 2 + 4;
const int KEPT = 5;

void store(ivec2 pixel, vec4 sum, ivec2 size)
{
    if (all(lessThan(pixel, size)))
        imageStore(target, pixel, shade(pixel, params.coarse * sum));
}

void main()
{
    ivec2 last = imageSize(smaller) - 1, size = imageSize(target);
    ivec2 first = ivec2(gl_GlobalInvocationID.xy) * ivec2(DOUBLE_COLUMNS, DOUBLE_ROWS);
    int end = min(first.y + DOUBLE_ROWS, size.y) / 2;
    vec4 rows[KEPT][DOUBLE_COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    for (int row = 0; row < KEPT; ++row)
        for (int i = 0; i < DOUBLE_COLUMNS; ++i)
            rows[row][i] = vec4(0.0);
    for (int y = first.y / 2 - 2; y < end + 2; ++y) {
        vec4 texels[LOADED];
        for (int i = 0; i < LOADED; ++i) {
            ivec2 texel = ivec2(first.x / 2 + i - 2, y);
            texels[i] = imageLoad(smaller, clamp(texel, ivec2(0), last));
        }
        for (int row = 1; row < KEPT; ++row)
            for (int i = 0; i < DOUBLE_COLUMNS; ++i)
                rows[row - 1][i] = rows[row][i];
        for (int i = 0; i < DOUBLE_COLUMNS; ++i) {
            int at = (i + 1) / 2;
            rows[KEPT - 1][i] = four(texels[at], texels[at + 1], texels[at + 2], texels[at + 3],
                                     (i & 1) == 1);
        }
        if (y < first.y / 2 + 2)
            continue;
        for (int i = 0; i < DOUBLE_COLUMNS; ++i) {
            ivec2 pixel = ivec2(first.x + i, 2 * (y - 2));
            store(pixel, four(rows[0][i], rows[1][i], rows[2][i], rows[3][i], false), size);
            store(pixel + ivec2(0, 1), four(rows[1][i], rows[2][i], rows[3][i], rows[4][i], true),
                  size);
        }
    }
}
