#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The transpose of the 13 taps of a downsampling to exactly half the size (halve.comp) in tiles, for GPUs.
// Along each axis three pixels read a texel with the weights (1 2 1) / 8 of the longer kernel, and two of
// them with 1 / 4 of the shorter one. Those beside the first and the last texel also read the two beyond.
#include "lib/block.glsl"
#include "lib/finite.glsl"

UNIFORM_BLOCK(ADJOINT_FILTER_BLOCK);
#include "variants/adjoint_tiles.glsl"

const int RUN = ADJOINT_HALVE_ROWS / ADJOINT_HALVE_RUNS;
const int INVOCATIONS = ADJOINT_HALVE_COLUMNS * ADJOINT_HALVE_RUNS;
const int LOADED_COLUMNS = ADJOINT_HALVE_COLUMNS / 2 + 2, LOADED_ROWS = ADJOINT_HALVE_ROWS / 2 + 2;
const int LOADED = LOADED_COLUMNS * LOADED_ROWS;

layout(local_size_x = ADJOINT_HALVE_COLUMNS, local_size_y = ADJOINT_HALVE_RUNS) in;

shared vec4 tile[LOADED_ROWS][LOADED_COLUMNS];

void load_tile(ivec2 first)
{
    [[unroll]] for (int i = 0; i < LOADED; i += INVOCATIONS) {
        int at = i + int(gl_LocalInvocationIndex);
        ivec2 place = ivec2(at % LOADED_COLUMNS, at / LOADED_COLUMNS);
        if (at < LOADED)
            tile[place.y][place.x] = cotangent_at(first + place);
    }
}

// The sums of three pixels with the weights of both kernels, times 8.
vec4 longer(vec4 a, vec4 b, vec4 c, bool edge)
{
    return a + (edge ? 4.0 : 2.0) * b + c;
}

vec4 shorter(vec4 a, vec4 b, vec4 c, bool edge, bool odd)
{
    return 2.0 * ((odd ? c : a) + (edge ? 2.0 : 1.0) * b);
}

void main()
{
    ivec2 first = ivec2(gl_WorkGroupID.xy) * ivec2(ADJOINT_HALVE_COLUMNS, ADJOINT_HALVE_ROWS);
    int column = int(gl_LocalInvocationID.x), top = RUN * int(gl_LocalInvocationID.y);
    ivec2 last = imageSize(target) - 1, pixel = first + ivec2(column, top);
    bool edge = pixel.x == 0 || pixel.x == last.x, odd = (column & 1) == 1;
    vec4 more[RUN], six[RUN / 2 + 2], four[RUN / 2 + 2];

    // First, since they take as long as the tile.
    [[unroll]] for (int i = 0; i < RUN; ++i)
        more[i] = added_at(pixel + ivec2(0, i));
    load_tile(first / 2 - 1);
    barrier();
    [[unroll]] for (int row = 0; row < RUN / 2 + 2; ++row) {
        int at = column / 2, line = top / 2 + row;
        vec4 a = tile[line][at], b = tile[line][at + 1], c = tile[line][at + 2];
        six[row] = longer(a, b, c, edge);
        four[row] = shorter(a, b, c, edge, odd);
    }
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        ivec2 place = pixel + ivec2(0, i);
        int at = i / 2;
        bool at_edge = place.y == 0 || place.y == last.y, at_odd = (i & 1) == 1;
        vec4 sum = longer(six[at], six[at + 1], six[at + 2], at_edge)
                 + shorter(four[at], four[at + 1], four[at + 2], at_edge, at_odd);
        store_sum(place, params.gain / 64.0 * sum + more[i]);
    }
}
