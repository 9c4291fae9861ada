#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The transpose of an upsampling to exactly twice the size in tiles, for GPUs. Along
// each axis, eight pixels read a texel. An invocation adds up those of a column for the tile's rows; then
// the sums of columns are added up from shared memory.
#include "lib/block.glsl"
#include "lib/finite.glsl"

UNIFORM_BLOCK(ADJOINT_FILTER_BLOCK);
#include "variants/adjoint_tiles.glsl"

const int READERS = 8, LANES = 2 * ADJOINT_DOUBLE_COLUMNS + READERS - 2;
const int ROWS = ADJOINT_DOUBLE_ROWS;
// An invocation ends the sums of a texel in every GROUP_ROWS'th row.
const int HALF = LANES / 2, GROUP_ROWS = LANES / HALF;

layout(local_size_x = LANES) in;

// Even and odd columns are apart, so that neighbours read neighbouring banks.
shared vec4 tile[ROWS][2][HALF + 4];

// The weights of the pixels from 2 t - 3 on that read texel t.
float[READERS] weights()
{
    vec4 taps = params.taps[0];
    return float[](taps.w, taps.x, taps.z, taps.y, taps.y, taps.z, taps.x, taps.w);
}

// What the first and the last texel get more, by the distance of a pixel from the edge: the weights of the
// two texels beyond.
vec3 edge_weights()
{
    vec4 taps = params.taps[0];
    return vec3(taps.z + taps.w, taps.x, taps.w);
}

// The sums along a column of pixels.
vec4[ROWS] along_column(int x, int first, int last)
{
    float shares[] = weights();
    vec3 more = edge_weights();
    vec4 sums[ROWS];

    [[unroll]] for (int i = 0; i < ROWS; ++i)
        sums[i] = vec4(0.0);
    [[unroll]] for (int at = 0; at < 2 * ROWS + READERS - 2; ++at) {
        vec4 value = cotangent_at(ivec2(x, 2 * first - 3 + at));
        [[unroll]] for (int i = 0; i < ROWS; ++i)
            if (at >= 2 * i && at < 2 * i + READERS)
                sums[i] += shares[at - 2 * i] * value;
    }
    if (first == 0)
        [[unroll]] for (int at = 0; at < 3; ++at)
            sums[0] += more[at] * cotangent_at(ivec2(x, at));
    if (first + ROWS > last)
        [[unroll]] for (int at = 0; at < 3; ++at) {
            vec4 value = more[at] * cotangent_at(ivec2(x, 2 * last + 1 - at));
            [[unroll]] for (int i = 0; i < ROWS; ++i)
                sums[i] += first + i == last ? value : vec4(0.0);
        }
    return sums;
}

vec4 at_column(int row, int column)
{
    return tile[row][column & 1][column / 2];
}

void main()
{
    ivec2 last = imageSize(target) - 1;
    ivec2 first = ivec2(gl_WorkGroupID.xy) * ivec2(ADJOINT_DOUBLE_COLUMNS, ROWS);
    int lane = int(gl_LocalInvocationID.x), column = lane % HALF, x = first.x + column;
    float shares[] = weights();
    vec3 more = edge_weights();

    vec4 sums[] = along_column(2 * first.x - 3 + lane, first.y, last.y);
    [[unroll]] for (int i = 0; i < ROWS; ++i)
        tile[i][lane & 1][lane / 2] = sums[i];
    barrier();
    if (column >= ADJOINT_DOUBLE_COLUMNS || x > last.x)
        return;
    [[unroll]] for (int i = 0; i < ROWS; i += GROUP_ROWS) {
        int row = i + lane / HALF;
        vec4 sum = vec4(0.0);
        [[unroll]] for (int at = 0; at < READERS; ++at)
            sum += shares[at] * at_column(row, 2 * column + at);
        if (x == 0)
            [[unroll]] for (int at = 0; at < 3; ++at)
                sum += more[at] * at_column(row, 3 + at);
        if (x == last.x)
            [[unroll]] for (int at = 0; at < 3; ++at)
                sum += more[at] * at_column(row, 2 * column + 4 - at);
        ivec2 pixel = ivec2(x, first.y + row);
        store_sum(pixel, params.gain * sum + added_at(pixel));
    }
}
