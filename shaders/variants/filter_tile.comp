#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// A filter for GPUs. A workgroup computes the weights of its columns and rows once, and filters each row
// of the source that it needs along x once, into shared memory.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);
#include "lib/storage.glsl"
#include "lib/filter.glsl"

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 2) uniform sampler2D own;
layout(set = 0, binding = 3) uniform writeonly image2D target;

const int SIDE = FILTER_TILE_SIDE, X = 0, Y = 1;

layout(local_size_x = SIDE, local_size_y = SIDE) in;

shared int firsts[2][SIDE];
shared vec3 weights[2][MAX_WINDOW][SIDE];
// A constant's default is 0, which is no size of an array.
shared vec4 sums[(KERNELS * SOURCE_ROWS + 1) * SIDE];

void keep_window(int axis, int number, ivec2 pixel)
{
    ivec2 size = textureSize(source, 0);
    vec2 target_size = vec2(params.target_width, params.target_height);
    Place place = place_in(source, pixel, ivec2(target_size));
    vec2 ratio = vec2(size) / target_size;
    Axis along = axis_x(place, size, ratio);
    if (axis == Y)
        along = axis_y(place, size, ratio);
    Window window = window_of(settled(along), WINDOW, axis == X);
    firsts[axis][number] = window.first;
    [[unroll]] for (int i = 0; i < WINDOW; ++i)
        weights[axis][i][number] = window.weights[i];
}

int place_of(int kernel, int row, int column)
{
    return (kernel * SOURCE_ROWS + row) * SIDE + column;
}

void keep_sums(int column, int row, int line)
{
    vec4 sum[3] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
    [[unroll]] for (int i = 0; i < WINDOW; ++i) {
        vec4 texel = fetch_clamped(source, ivec2(firsts[X][column] + i, line));
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            sum[kernel] += weights[X][i][column][kernel] * texel;
    }
    [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
        sums[place_of(kernel, row, column)] = sum[kernel];
}

vec4 filtered(int column, int number, int first)
{
    vec4 sum = vec4(0.0);
    [[unroll]] for (int i = 0; i < WINDOW; ++i)
        [[unroll]] for (int kernel = 0; kernel < KERNELS; ++kernel)
            sum += weights[Y][i][number][kernel] * sums[place_of(kernel, first + i, column)];
    return sum;
}

void main()
{
    int at = int(gl_LocalInvocationIndex), column = at % SIDE, number = at / SIDE;
    ivec2 first = ivec2(gl_WorkGroupID.xy) * SIDE, pixel = first + ivec2(column, number);

    if (number <= Y)
        keep_window(number, column, first + column);
    barrier();
    int line = firsts[Y][0], rows = firsts[Y][SIDE - 1] + WINDOW - line;
    for (int row = number; row < rows; row += SIDE)
        keep_sums(column, row, line + row);
    barrier();
    if (any(greaterThanEqual(pixel, imageSize(target))))
        return;
    vec4 sum = params.coarse * (filtered(column, number, firsts[Y][number] - line) / params.divisor);
    if (ADD_OWN != 0)
        sum += params.own * texelFetch(own, pixel, 0);
    imageStore(target, pixel, stored(sum));
}
