// The transpose of a filter in tiles: a filter of the cotangents whose windows are the pixels that read a texel, by
// the table.
#include "lib/window.glsl"
#include "lib/adjoint_filter.glsl"

layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;
#define IS_TRANSPOSED true
#include "variants/filter_tile.glsl"

// Windows in a simple ratio begin as those of filters. Pixels that do not read the texel have no weight.
Window window_at(ivec2 pixel, bool along_x)
{
    ivec2 within = min(pixel, imageSize(target) - 1);
    int at_texel = along_x ? within.x : within.y;
    ivec4 readers = ivec4(entry(at_texel + (along_x ? params.start_x : params.start_y)));
    Window window;
    int exact = along_x ? EXACT : EXACT_ROWS, at_pixel = along_x ? pixel.x : pixel.y;
    window.first = exact != 0 ? exact_first(exact, at_pixel, WINDOW) : readers.x;
    [[unroll]] for (int i = 0; i < WINDOW; ++i) {
        int at = window.first + i;
        window.weights[i] = vec3(0.0);
        if (at >= readers.x && at < readers.x + readers.y)
            [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
                window.weights[i][kernel] =
                    entry(readers.z + LEVELS * (at - readers.w) + kernel)[at_texel % ADJOINT_SIDE];
    }
    return window;
}
