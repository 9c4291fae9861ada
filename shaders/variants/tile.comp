#version 450
#extension GL_GOOGLE_include_directive : require
// The complete bloom of an image for GPUs: symmetric kernels along columns and rows. A workgroup writes a tile, and
// keeps its vertical sums in shared memory between the two.
#include "variants/fused_bloom.glsl"

layout(set = 0, binding = 1) uniform sampler2D image;
#define ENDED_BINDING 2
#include "lib/ended.glsl"
layout(set = 0, binding = ENDED_TARGET) uniform writeonly image2D target;

const int RUN = TILE_ROWS / TILE_RUNS;

layout(local_size_x = TILE_LOADED, local_size_y = TILE_RUNS) in;

// The vertical sums, packed in the format of their image. They are stored in planes of words, so
// that neighbours are in neighbouring banks.
const int WORDS = FORMAT == STORED_SINGLE ? 3 : FORMAT == STORED_HALF ? 2 : 1;
shared uint sums[WORDS][TILE_ROWS][TILE_LOADED];

void keep_sum(int row, int column, vec3 sum)
{
    if (FORMAT == STORED_SINGLE) {
        for (int channel = 0; channel < WORDS; ++channel)
            sums[channel][row][column] = floatBitsToUint(as_stored(sum, FORMAT)[channel]);
    } else if (FORMAT == STORED_HALF) {
        vec3 kept = as_stored(sum, FORMAT);
        sums[0][row][column] = packHalf2x16(kept.rg);
        sums[WORDS - 1][row][column] = packHalf2x16(kept.bb);
    } else {
        uvec3 level = uvec3(nearest_level(sum));
        sums[0][row][column] = level.r | level.g << 8 | level.b << 16;
    }
}

vec3 kept_sum(int row, int column)
{
    if (FORMAT == STORED_SINGLE) {
        vec3 sum;
        for (int channel = 0; channel < WORDS; ++channel)
            sum[channel] = uintBitsToFloat(sums[channel][row][column]);
        return sum;
    }
    if (FORMAT == STORED_HALF)
        return vec3(unpackHalf2x16(sums[0][row][column]),
                    unpackHalf2x16(sums[WORDS - 1][row][column]).x);
    uint levels = sums[0][row][column];
    return from_level(vec3(uvec3(levels, levels >> 8, levels >> 16) & 255u), FORMAT);
}

vec3 value_at(ivec2 place, ivec2 last)
{
    return thresholded(texelFetch(image, clamp(place, ivec2(0), last), 0).rgb);
}

// Computes a run of vertical sums in one column and loads each pixel once.
void sum_vertically(ivec2 place, ivec2 last, int top, int column)
{
    vec3 run[RUN];
    for (int i = 0; i < RUN; ++i)
        run[i] = vec3(0.0);
    for (int at = -RADIUS; at < RUN + RADIUS; ++at) {
        vec3 value = value_at(place + ivec2(0, at), last);
        for (int i = 0; i < RUN; ++i)
            if (abs(at - i) <= RADIUS)
                run[i] += vertical_weight(at - i) * value;
    }
    for (int i = 0; i < RUN; ++i)
        keep_sum(top + i, column, run[i]);
}

vec3 sum_horizontally(int row, int column)
{
    vec3 sum = vec3(0.0);
    for (int tap = -RADIUS; tap <= RADIUS; ++tap)
        sum += horizontal_weight(tap) * kept_sum(row, column + RADIUS + tap);
    return sum;
}

void main()
{
    const int columns = TILE_LOADED - 2 * RADIUS;
    ivec2 last = textureSize(image, 0) - 1;
    ivec2 first = ivec2(gl_WorkGroupID.xy) * ivec2(columns, TILE_ROWS);
    int column = int(gl_LocalInvocationID.x), top = int(gl_LocalInvocationID.y) * RUN;

    sum_vertically(first + ivec2(column - RADIUS, top), last, top, column);
    barrier();
    if (column >= columns || first.x + column > last.x)
        return;
    for (int i = 0; i < RUN; ++i) {
        // Consecutive invocations take consecutive rows, so that the accesses of a warp are
        // adjacent in memory.
        int row = i * TILE_RUNS + int(gl_LocalInvocationID.y);
        ivec2 pixel = first + ivec2(column, row);
        if (pixel.y > last.y)
            continue;
        vec4 bloom = vec4(as_stored(sum_horizontally(row, column), FORMAT), 1.0);
        imageStore(target, pixel, ended(texelFetch(image, pixel, 0), bloom, pixel));
    }
}
