#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#pragma compile floats
// The cotangents of the threshold pass, for images as words of the same size (see
// adjoint_threshold.frag).
#include "lib/block.glsl"
#include "lib/finite.glsl"
#include "lib/threshold.glsl"
#include "lib/threshold_slope.glsl"

UNIFORM_BLOCK(THRESHOLD_BLOCK);
#include "lib/storage.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = ADJOINT_SIDE, ROWS = TEXEL_ROWS;

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, image);
READ_IMAGE(2, cotangents);
#define ADDED 3
#define DIFFERENTIATED 4
#include "variants/adjoint_runs.glsl"

void write_row(int first, int y)
{
    vec4 found[COLUMNS];

    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        int x = min(first + i, read_shapes[0].x - 1);
        vec4 colour = finite_or_zero(load_floats(image, read_shapes[0], x, y));
        vec4 cotangent = load_floats(cotangents, read_shapes[1], x, y);
        found[i] = back_through_threshold(colour, vec4(cotangent.rgb, 0.0), THRESHOLD_MODE,
                                          params.threshold, params.knee);
    }
    store_gathered(first, y, 1.0, found);
}

#include "variants/rows.glsl"
