// The transpose of a filter: each texel gathers the cotangents of the pixels that read it, with the
// weights from a table (csrc/passes/taps.h). With BY these are the cotangents of a composite without a
// curve, from which those of the bloom follow by a factor where the scene is finite.

UNIFORM_BLOCK(ADJOINT_FILTER_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D cotangents;
layout(set = 0, binding = 2) uniform sampler2D table;
layout(set = 0, binding = 3) uniform sampler2D scene;

#define TARGET_BINDING 6
#define ADDED_SHARE params.share
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

vec4 entry(int place)
{
    return texelFetch(table, ivec2(place % TABLE_WIDTH, place / TABLE_WIDTH), 0);
}

vec4 cotangent_at(ivec2 place)
{
    vec4 value = texelFetch(cotangents, place, 0);
    return BY == BY_BLOOM ? vec4(where_finite(value, texelFetch(scene, place, 0)).rgb, 0.0) : value;
}

// The texels of weights of a pixel.
const int STRIDE = LEVELS == 1 ? 1 : ADJOINT_SIDE;

// The pixels that read a texel: the first one, their number, and where its weights are.
ivec3 readers(int start, int texel)
{
    ivec4 row = ivec4(entry(start + texel));
    return ivec3(row.xy, row.z + STRIDE * (row.x - row.w));
}

// The weights of a texel in all kernels.
vec4 weights_at(int place, int texel)
{
    int number = texel % ADJOINT_SIDE;
    return LEVELS == 1 ? vec4(entry(place)[number], 0.0, 0.0, 0.0) : entry(place + number);
}

// Of each kernel the weights of rows times those of columns, added up.
vec4 shade()
{
    const bool one_row = DIRECTION == DIRECTION_HORIZONTAL, one_column = DIRECTION == DIRECTION_VERTICAL;
    ivec3 columns = one_column ? ivec3(PIXEL.x, 1, 0) : readers(params.start_x, PIXEL.x);
    ivec3 rows = one_row ? ivec3(PIXEL.y, 1, 0) : readers(params.start_y, PIXEL.y);
    vec4 sum = vec4(0.0);
    for (int y = 0; y < rows.y; ++y) {
        vec4 shares = one_row ? vec4(1.0) : weights_at(rows.z + STRIDE * y, PIXEL.y);
        for (int x = 0; x < columns.y; ++x) {
            vec4 weights = one_column ? vec4(1.0) : weights_at(columns.z + STRIDE * x, PIXEL.x);
            sum += dot(shares, weights) * cotangent_at(ivec2(columns.x + x, rows.x + y));
        }
    }
    return gathered(params.gain * sum);
}
