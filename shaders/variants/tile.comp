// The complete bloom of an image for GPUs, or its transpose (fused_bloom.glsl). A workgroup writes a tile, and keeps
// its vertical sums in shared memory between the two blurs. As four passes `Separable` takes 0.387 ms in place of 0.098,
// with a knee 0.387 in place of 0.141 (3840 x 2160 in float16, H200, 2026-11-28).
#include "variants/fused_bloom.glsl"

const int RUN = TILE_ROWS / TILE_RUNS;

layout(local_size_x = TILE_LOADED, local_size_y = TILE_RUNS) in;
SAMPLED_IMAGE(SLOT_SOURCE, source);
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;

// The vertical sums, packed in the format of their image. They are stored in planes of words, so
// that neighbours are in neighbouring banks. With floats `Separable` takes 0.170 ms in place of 0.111
// (3840 x 2160 in float16, H200, 2026-11-27).
const int WORDS = FORMAT == STORED_SINGLE ? 3 : FORMAT == STORED_HALF ? 2 : 1;
shared uint sums[WORDS][TILE_ROWS][TILE_LOADED];

void keep_sum(int row, int column, vec3 sum)
{
    if (FORMAT == STORED_SINGLE) {
        for (int channel = 0; channel < WORDS; ++channel)
            sums[channel][row][column] = floatBitsToUint(kept(sum)[channel]);
    } else if (FORMAT == STORED_HALF) {
        vec3 half_sum = kept(sum);
        sums[0][row][column] = packHalf2x16(half_sum.rg);
        sums[WORDS - 1][row][column] = packHalf2x16(half_sum.bb);
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

// The value of a pixel. Outside of the image it is the outermost one, of the transpose 0. It is fetched there too: no
// fetch waits for a branch.
vec3 value_at(ivec2 place, ivec2 last)
{
    ivec2 within = clamp(place, ivec2(0), last);
    vec4 value = texelFetch(source, within, 0);
#if TRANSPOSED
    value = where_finite(value, other_at(within));
    return place == within ? value.rgb : vec3(0.0);
#else
    return thresholded(value.rgb);
#endif
}

// What the taps beyond an edge have read, from the pixel at the edge on.
vec3 column_end(ivec2 place, int inwards, ivec2 last)
{
    vec3 sum = vec3(0.0);
    [[dont_unroll]] for (int distance = 0; distance < RADIUS; ++distance)
        sum += weight_beyond(true, distance, RADIUS) * value_at(place + ivec2(0, inwards * distance), last);
    return sum;
}

vec3 row_end(int row, int column, int inwards)
{
    vec3 sum = vec3(0.0);
    [[dont_unroll]] for (int distance = 0; distance < RADIUS; ++distance)
        sum += weight_beyond(false, distance, RADIUS) * kept_sum(row, column + inwards * distance);
    return sum;
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
                run[i] += kernel_weight(true, at - i) * value;
    }
    if (TRANSPOSED != 0 && place.y == 0)
        run[0] += column_end(place, 1, last);
    if (TRANSPOSED != 0 && place.y + RUN > last.y) {
        vec3 end = column_end(ivec2(place.x, last.y), -1, last);
        for (int i = 0; i < RUN; ++i)
            run[i] += place.y + i == last.y ? end : vec3(0.0);
    }
    for (int i = 0; i < RUN; ++i)
        keep_sum(top + i, column, run[i]);
}

vec3 sum_horizontally(int row, int column, int x, int last)
{
    vec3 sum = vec3(0.0);
    for (int tap = -RADIUS; tap <= RADIUS; ++tap)
        sum += kernel_weight(false, tap) * kept_sum(row, column + tap);
    if (TRANSPOSED != 0 && x == 0)
        sum += row_end(row, column, 1);
    if (TRANSPOSED != 0 && x == last)
        sum += row_end(row, column, -1);
    return sum;
}

void main()
{
    const int columns = TILE_LOADED - 2 * RADIUS;
    ivec2 last = textureSize(source, 0) - 1;
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
        vec3 sum = sum_horizontally(row, column + RADIUS, pixel.x, last.x);
        imageStore(target, pixel, ended(texelFetch(source, pixel, 0), vec4(kept(sum), 1.0), pixel));
    }
}
