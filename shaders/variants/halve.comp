#version 450
#extension GL_GOOGLE_include_directive : require
// A level of the pyramid from one of exactly twice its size: the 13 taps, which there lie between
// texels, as the sum of two separable kernels, (1 1 1 1) / 4 and (1 1 2 2 1 1) / 8 a side, each with
// half of the weight. An invocation walks down a strip and loads each texel once.
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/threshold.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"

layout(local_size_x = ROW_INVOCATIONS) in;
layout(set = 0, binding = 1, SOURCE_FORMAT) uniform readonly image2D source;
layout(set = 0, binding = 2) uniform writeonly image2D target;

const int LOADED = 2 * HALVE_COLUMNS + 4;

vec4 load(ivec2 texel)
{
    vec4 value = imageLoad(source, texel);
    if (FROM_IMAGE == 0)
        return value;
    vec4 kept =
        apply_threshold(finite_or_zero(value), THRESHOLD_MODE, params.threshold, params.knee);
    return as_stored(kept, FORMAT);
}

void main()
{
    ivec2 last = imageSize(source) - 1, size = imageSize(target);
    ivec2 first = ivec2(gl_GlobalInvocationID.xy) * ivec2(HALVE_COLUMNS, HALVE_ROWS);
    int end = min(first.y + HALVE_ROWS, size.y);
    // Of the output row that a pair of source rows ends, and of the one that it is the middle of.
    vec4 ending[HALVE_COLUMNS], middle[HALVE_COLUMNS], starting[HALVE_COLUMNS];

    if (any(greaterThanEqual(first, size)))
        return;
    for (int i = 0; i < HALVE_COLUMNS; ++i)
        ending[i] = middle[i] = vec4(0.0);
    for (int y = first.y - 1; y <= end; ++y) {
        for (int i = 0; i < HALVE_COLUMNS; ++i)
            starting[i] = vec4(0.0);
        for (int half_row = 0; half_row < 2; ++half_row) {
            int row = clamp(2 * y + half_row, 0, last.y);
            vec4 texels[LOADED];
            for (int i = 0; i < LOADED; ++i) {
                int column = clamp(2 * first.x + i - 2, 0, last.x);
                texels[i] = load(ivec2(column, row));
            }
            for (int i = 0; i < HALVE_COLUMNS; ++i) {
                vec4 inner = texels[2 * i + 2] + texels[2 * i + 3];
                vec4 four = inner + texels[2 * i + 1] + texels[2 * i + 4];
                vec4 six = four + inner + texels[2 * i] + texels[2 * i + 5];
                // Shares of 1/2 * 1/4 * 1/4 and 1/2 * 1/8 * 1/8 (the two middle rows twice that).
                ending[i] += six / 128.0 + (half_row == 0 ? four / 32.0 : vec4(0.0));
                middle[i] += six / 64.0 + four / 32.0;
                starting[i] += six / 128.0 + (half_row == 1 ? four / 32.0 : vec4(0.0));
            }
        }
        for (int i = 0; i < HALVE_COLUMNS; ++i) {
            ivec2 pixel = ivec2(first.x + i, y - 1);
            if (y > first.y && pixel.x < size.x)
                imageStore(target, pixel, stored(ending[i]));
            ending[i] = middle[i];
            middle[i] = starting[i];
        }
    }
}
