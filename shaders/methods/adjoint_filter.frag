// The transpose of a filter: each texel gathers the cotangents of the pixels that read it, with the
// weights from a table (csrc/passes/taps.h). With BY these are the cotangents of a composite without a
// curve, from which those of the bloom follow by a factor where the scene is finite.
#include "lib/block.glsl"
#include "lib/finite.glsl"

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

// The pixels that read a texel: the first one, their number, and where their weights are.
ivec3 readers(int start, int texel)
{
    return ivec3(entry(start + texel).xyz);
}

// One kernel: an entry has the weights of four pixels.
vec4 along(int start, ivec2 pixel, bool vertical)
{
    ivec2 last = textureSize(cotangents, 0) - 1;
    ivec3 row = readers(start, vertical ? pixel.y : pixel.x);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < row.y; i += 4) {
        vec4 weights = entry(row.z + i / 4);
        [[unroll]] for (int k = 0; k < 4; ++k) {
            int at = row.x + i + k;
            ivec2 place = vertical ? ivec2(pixel.x, at) : ivec2(at, pixel.y);
            sum += weights[k] * cotangent_at(min(place, last));
        }
    }
    return sum;
}

// Up to four kernels, whose weights an entry has: those of rows times those of columns, added up.
vec4 across(ivec2 pixel)
{
    ivec3 columns = readers(params.start_x, pixel.x), rows = readers(params.start_y, pixel.y);
    vec4 sum = vec4(0.0);
    for (int y = 0; y < rows.y; ++y) {
        vec4 shares = entry(rows.z + y);
        for (int x = 0; x < columns.y; ++x)
            sum += dot(shares, entry(columns.z + x))
                 * cotangent_at(ivec2(columns.x + x, rows.x + y));
    }
    return sum;
}

vec4 shade()
{
    vec4 sum = DIRECTION == DIRECTION_BOTH ? across(PIXEL)
             : DIRECTION == DIRECTION_VERTICAL
                 ? along(params.start_y, PIXEL, true)
                 : along(params.start_x, PIXEL, false);
    return gathered(params.gain * sum);
}
