#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#pragma compile floats
// The cotangents of a composite's scene or bloom, for images as words (see adjoint_composite.frag).
#include "lib/block.glsl"

UNIFORM_BLOCK(COMPOSITE_BLOCK);
#include "lib/storage.glsl"
#include "lib/composite.glsl"
#include "variants/pixels.glsl"

const int COLUMNS = ADJOINT_SIDE, ROWS = TEXEL_ROWS;

layout(local_size_x = ROW_INVOCATIONS) in;
READ_IMAGE(1, scene);
READ_IMAGE(2, bloom);
READ_IMAGE(3, cotangents);
#define ADDED 4
#define DIFFERENTIATED 5
#include "variants/adjoint_runs.glsl"
#include "lib/adjoint_composite.glsl"

void write_row(int first, int y)
{
    vec4 found[COLUMNS];

    [[unroll]] for (int i = 0; i < COLUMNS; ++i) {
        int x = min(first + i, read_shapes[0].x - 1);
        found[i] = back_composite(
            load_floats(scene, read_shapes[0], x, y),
            LEVELS == 0 ? vec4(0.0) : load_floats(bloom, read_shapes[1], x, y), 1.0,
            load_floats(cotangents, read_shapes[2], x, y), BY);
    }
    store_gathered(first, y, 1.0, found);
}

#include "variants/rows.glsl"
