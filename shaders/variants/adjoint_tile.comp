#version 450
#extension GL_GOOGLE_include_directive : require
// The derivatives by an image of its complete bloom, for GPUs: the transpose of tile.comp, for a composite
// without a curve, which is a factor. The transpose of a blur whose taps beyond an edge read the edge has
// the same symmetric kernel: there are no cotangents beyond the edges, and the texel at the edge also has
// what the taps beyond it have read. Both axes commute, so a workgroup keeps its vertical sums in shared
// memory, as tile.comp.
#include "variants/fused_bloom.glsl"
#include "lib/threshold_slope.glsl"
#include "lib/where_finite.glsl"

const int RUN = TILE_ROWS / TILE_RUNS;

layout(local_size_x = TILE_LOADED, local_size_y = TILE_RUNS) in;
layout(set = 0, binding = 1) uniform sampler2D cotangents;
layout(set = 0, binding = 2) uniform sampler2D image;
layout(set = 0, binding = 3) uniform writeonly image2D target;

// In planes, so that neighbours are in neighbouring banks.
shared float sums[3][TILE_ROWS][TILE_LOADED];

// 0 outside of the image. It is fetched there too: no fetch waits for a branch.
vec3 cotangent_at(ivec2 place, ivec2 last)
{
    ivec2 within = clamp(place, ivec2(0), last);
    vec4 value = texelFetch(cotangents, within, 0);
    value = where_finite(value, texelFetch(image, within, 0));
    return place == within ? value.rgb : vec3(0.0);
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

// Computes a run of vertical sums in one column and loads each pixel once, and near an edge twice.
void sum_vertically(ivec2 place, ivec2 last, int top, int column)
{
    vec3 run[RUN];
    for (int i = 0; i < RUN; ++i)
        run[i] = vec3(0.0);
    for (int at = -RADIUS; at < RUN + RADIUS; ++at) {
        vec3 value = cotangent_at(place + ivec2(0, at), last);
        for (int i = 0; i < RUN; ++i)
            if (abs(at - i) <= RADIUS)
                run[i] += vertical_weight(at - i) * value;
    }
    for (int distance = 0; place.y == 0 && distance < RADIUS; ++distance)
        run[0] += vertical_beyond(distance) * cotangent_at(ivec2(place.x, distance), last);
    if (place.y + RUN > last.y) {
        vec3 sum = vec3(0.0);
        for (int distance = 0; distance < RADIUS; ++distance)
            sum += vertical_beyond(distance) * cotangent_at(ivec2(place.x, last.y - distance), last);
        for (int i = 0; i < RUN; ++i)
            run[i] += place.y + i == last.y ? sum : vec3(0.0);
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
    float exposed = exp2(params.exposure);
    float gain = exposed * (BLOOM == BLOOM_LIT ? 1.0 : params.intensity);
    float share = exposed * (COMPOSITE == COMPOSITE_MIX ? 1.0 - params.intensity : 1.0);

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
        vec3 cotangent = gain * sum_horizontally(row, column, pixel.x == 0, pixel.x == last.x);
        vec4 found = back_through_threshold(finite_or_zero(scene), vec4(cotangent, 0.0),
                                            THRESHOLD_MODE, params.threshold, params.knee);
        found += vec4(vec3(share), 1.0) * texelFetch(cotangents, pixel, 0);
        imageStore(target, pixel, where_finite(found, scene));
    }
}
