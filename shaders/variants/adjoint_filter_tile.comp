// The transpose of a filter in tiles: a filter of the cotangents whose windows are the pixels that read a texel, by
// the table.
#define WINDOW_WEIGHTS MAX_READERS
#include "lib/window.glsl"
#include "lib/adjoint_filter.glsl"

layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;
// Turned, an invocation loads a column, and those of a workgroup rows. Weights at the edges differ.
const bool TURNED = FILTER_TILE_KEEPS(EXACT, KERNELS, WINDOW_WIDTH, WINDOW_HEIGHT), REPEATS = false;
#include "variants/filter_tile.glsl"

Window window_at(int picture, int pixel, bool along_x)
{
    bool horizontal = along_x != TURNED;
    int at_texel = min(pixel, imageSize(target)[horizontal ? 0 : 1] - 1);
    Window window;
    int start = int(params.pictures[picture][horizontal ? 0 : 1]);
    [[unroll]] for (int i = 0; i < MAX_SIDE; ++i)
        window.weights[i] = vec3(i == 0 ? 1.0 : 0.0);
    // An axis that is kept.
    window.first = at_texel;
    if (start < 0)
        return window;
    int count = along_x ? WIDTH : HEIGHT;
    window.first = WINDOW_FIRST(along_x ? EXACT : EXACT_ROWS, at_texel, count);
    // Filters change their weights less than a window from an edge. Elsewhere no table is waited for, for which a
    // transposed doubling takes 0.100 ms in place of 0.078 (3840 x 2160 in float32, H100, 2026-11-27).
    if (KEEPS && window.first >= count && window.first + 2 * count <= textureSize(cotangents, 0)[horizontal ? 0 : 1]) {
        [[unroll]] for (int i = 0; i < FILTER_TILE_WINDOW; ++i) {
            int part = at_texel % 2 * 2 + i / 4;
            window.weights[i].x = (horizontal ? params.inner_x[part] : params.inner_y[part])[i % 4];
        }
        return window;
    }
    ivec4 readers = ivec4(entry(at_texel + start));
    if (EXACT == 0)
        window.first = readers.x;
    [[unroll]] for (int i = 0; i < MAX_SIDE; ++i) {
        int at = window.first + i;
        window.weights[i] = vec3(0.0);
        if (at >= readers.x && at < readers.x + readers.y)
            [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
                window.weights[i][kernel] =
                    entry(readers.z + KERNELS * (at - readers.w) + kernel)[at_texel % ADJOINT_SIDE];
    }
    return window;
}
