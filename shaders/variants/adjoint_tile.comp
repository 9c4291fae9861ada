#version 450
#extension GL_GOOGLE_include_directive : require
// The derivatives by an image of its complete bloom, for GPUs: the transpose of tile.comp. The transpose
// of a blur whose taps beyond an edge read the edge has the same symmetric kernel: what is beyond the
// edges brings nothing, and the texel at the edge also has what the taps beyond it have read. Both
// axes commute, so a workgroup keeps its vertical sums in shared memory, as tile.comp.
#include "variants/fused_bloom.glsl"
#include "lib/threshold_slope.glsl"
#include "lib/where_finite.glsl"
#include "lib/adjoint_composite.glsl"

const int RUN = TILE_ROWS / TILE_RUNS;

layout(local_size_x = TILE_LOADED, local_size_y = TILE_RUNS) in;
layout(set = 0, binding = 1) uniform sampler2D image;
layout(set = 0, binding = 2) uniform sampler2D bloom;
layout(set = 0, binding = 3) uniform sampler2D cotangents;
layout(set = 0, binding = 4) uniform writeonly image2D target;

// In planes, so that neighbours are in neighbouring banks.
shared float sums[3][TILE_ROWS][TILE_LOADED];

vec4 back_at(ivec2 at, int by)
{
    return back_composite(texelFetch(image, at, 0), texelFetch(bloom, at, 0), 1.0,
                          texelFetch(cotangents, at, 0), by);
}

// The weights of the taps beyond the edge of a pixel at this distance from it.
float vertical_beyond(int distance)
{
    float sum = 0.0;
    for (int tap = distance + 1; tap <= RADIUS; ++tap)
        sum += vertical_weight(tap);
    return sum;
}

float horizontal_beyond(int distance)
{
    float sum = 0.0;
    for (int tap = distance + 1; tap <= RADIUS; ++tap)
        sum += horizontal_weight(tap);
    return sum;
}

// Computes a run of vertical sums in one column and loads each pixel once.
void sum_vertically(ivec2 place, ivec2 last, int top, int column)
{
    bool within = place.x >= 0 && place.x <= last.x, ends = place.y + RUN > last.y;
    vec3 run[RUN];
    for (int i = 0; i < RUN; ++i)
        run[i] = vec3(0.0);
    for (int at = -RADIUS; at < RUN + RADIUS; ++at) {
        int y = place.y + at;
        if (!within || y < 0 || y > last.y)
            continue;
        vec3 value = back_at(ivec2(place.x, y), BY_BLOOM).rgb;
        for (int i = 0; i < RUN; ++i)
            if (abs(at - i) <= RADIUS)
                run[i] += vertical_weight(at - i) * value;
        if (place.y == 0)
            run[0] += vertical_beyond(y) * value;
        if (!ends)
            continue;
        for (int i = 0; i < RUN; ++i)
            if (place.y + i == last.y)
                run[i] += vertical_beyond(last.y - y) * value;
    }
    for (int i = 0; i < RUN; ++i)
        for (int channel = 0; channel < 3; ++channel)
            sums[channel][top + i][column] = run[i][channel];
}

vec3 kept_sum(int row, int column)
{
    return vec3(sums[0][row][column], sums[1][row][column], sums[2][row][column]);
}

vec3 sum_horizontally(int row, int column, bool starts, bool ends)
{
    vec3 sum = vec3(0.0);
    for (int tap = -RADIUS; tap <= RADIUS; ++tap)
        sum += horizontal_weight(tap) * kept_sum(row, column + RADIUS + tap);
    for (int distance = 0; starts && distance < RADIUS; ++distance)
        sum += horizontal_beyond(distance) * kept_sum(row, column + RADIUS + distance);
    for (int distance = 0; ends && distance < RADIUS; ++distance)
        sum += horizontal_beyond(distance) * kept_sum(row, column + RADIUS - distance);
    return sum;
}

void main()
{
    const int columns = TILE_LOADED - 2 * RADIUS;
    ivec2 last = textureSize(image, 0) - 1;
    ivec2 first = ivec2(gl_WorkGroupID.xy) * ivec2(columns, TILE_ROWS);
    int column = int(gl_LocalInvocationID.x), top = int(gl_LocalInvocationID.y) * RUN;

    sum_vertically(ivec2(first.x + column - RADIUS, first.y + top), last, top, column);
    barrier();
    if (column >= columns || first.x + column > last.x)
        return;
    for (int i = 0; i < RUN; ++i) {
        int row = i * TILE_RUNS + int(gl_LocalInvocationID.y);
        ivec2 pixel = first + ivec2(column, row);
        if (pixel.y > last.y)
            continue;
        vec4 scene = texelFetch(image, pixel, 0);
        vec3 brought = sum_horizontally(row, column, pixel.x == 0, pixel.x == last.x);
        vec4 found = back_through_threshold(finite_or_zero(scene), vec4(brought, 0.0),
                                            THRESHOLD_MODE, params.threshold, params.knee);
        imageStore(target, pixel, where_finite(found + back_at(pixel, BY_SCENE), scene));
    }
}
