// The transpose of a filter in tiles: a filter of the cotangents whose windows are the pixels that read a texel, by
// the table.
#include "lib/window.glsl"
#include "lib/adjoint_filter.glsl"

layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;
#include "variants/filter_tile.glsl"

Window window_at(ivec2 pixel, bool along_x)
{
    ivec2 within = min(pixel, imageSize(target) - 1);
    int at_texel = along_x ? within.x : within.y;
    ivec4 readers = ivec4(entry(at_texel + (along_x ? params.start_x : params.start_y)));
    Window window;
    window.first = readers.x;
    [[unroll]] for (int i = 0; i < WINDOW; ++i) {
        int at = readers.x + i;
        window.weights[i] = vec3(0.0);
        if (i < readers.y)
            [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
                window.weights[i][kernel] =
                    entry(readers.z + LEVELS * (at - readers.w) + kernel)[at_texel % ADJOINT_SIDE];
    }
    return window;
}
