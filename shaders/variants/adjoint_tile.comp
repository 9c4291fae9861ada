// The derivatives by an image of its complete bloom, for GPUs: the transpose of tile.comp, for a composite
// without a curve, which is a factor. The transpose of a blur whose taps beyond an edge read the edge has
// the same symmetric kernel: there are no cotangents beyond the edges, and the texel at the edge also has
// what the taps beyond it have read. Both axes commute.
#include "variants/fused_bloom.glsl"

layout(set = 0, binding = 1) uniform sampler2D cotangents;
layout(set = 0, binding = 2) uniform sampler2D image;
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;
#include "variants/tile.glsl"

// In planes, so that neighbours are in neighbouring banks.
shared float sums[3][TILE_ROWS][TILE_LOADED];

void keep_sum(int row, int column, vec3 sum)
{
    for (int channel = 0; channel < 3; ++channel)
        sums[channel][row][column] = sum[channel];
}

vec3 kept_sum(int row, int column)
{
    return vec3(sums[0][row][column], sums[1][row][column], sums[2][row][column]);
}

// 0 outside of the image. It is fetched there too: no fetch waits for a branch.
vec3 value_at(ivec2 place, ivec2 last)
{
    ivec2 within = clamp(place, ivec2(0), last);
    vec4 value = texelFetch(cotangents, within, 0);
    value = where_finite(value, texelFetch(image, within, 0));
    return place == within ? value.rgb : vec3(0.0);
}

// The weights of the taps beyond the edge of a pixel at this distance from it. These loops stay loops: unrolled, the
// pass takes 397 us in place of 362 on an H100 (3840 x 2160 in float32).
float vertical_beyond(int distance)
{
    float sum = 0.0;
    [[dont_unroll]] for (int tap = distance + 1; tap <= RADIUS; ++tap)
        sum += vertical_weight(tap);
    return sum;
}

float horizontal_beyond(int distance)
{
    float sum = 0.0;
    [[dont_unroll]] for (int tap = distance + 1; tap <= RADIUS; ++tap)
        sum += horizontal_weight(tap);
    return sum;
}

void end_run(ivec2 place, ivec2 last, inout vec3 run[RUN])
{
    if (place.y == 0) {
        vec3 sum = vec3(0.0);
        [[dont_unroll]] for (int distance = 0; distance < RADIUS; ++distance)
            sum += vertical_beyond(distance) * value_at(ivec2(place.x, distance), last);
        run[0] += sum;
    }
    if (place.y + RUN > last.y) {
        vec3 sum = vec3(0.0);
        [[dont_unroll]] for (int distance = 0; distance < RADIUS; ++distance)
            sum += vertical_beyond(distance) * value_at(ivec2(place.x, last.y - distance), last);
        for (int i = 0; i < RUN; ++i)
            run[i] += place.y + i == last.y ? sum : vec3(0.0);
    }
}

void end_row(int row, int column, bool starts, bool ends, inout vec3 sum)
{
    if (starts)
        [[dont_unroll]] for (int distance = 0; distance < RADIUS; ++distance)
            sum += horizontal_beyond(distance) * kept_sum(row, column + RADIUS + distance);
    if (ends)
        [[dont_unroll]] for (int distance = 0; distance < RADIUS; ++distance)
            sum += horizontal_beyond(distance) * kept_sum(row, column + RADIUS - distance);
}

vec4 shade(ivec2 pixel, vec3 sum)
{
    float exposed = exp2(params.exposure);
    float gain = exposed * (LIT != 0 ? 1.0 : params.intensity);
    float share = exposed * (COMPOSITE == COMPOSITE_MIX ? 1.0 - params.intensity : 1.0);
    vec4 scene = texelFetch(image, pixel, 0);
    vec4 found = back_through_threshold(finite_or_zero(scene), vec4(gain * sum, 0.0), THRESHOLD_MODE,
                                        params.threshold, params.knee);
    found += vec4(vec3(share), 1.0) * texelFetch(cotangents, pixel, 0);
    return where_finite(found, scene);
}
