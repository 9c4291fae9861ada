// The complete bloom of an image for GPUs.
#include "variants/fused_bloom.glsl"

layout(set = 0, binding = 1) uniform sampler2D image;
#define ENDED_BINDING 2
#include "lib/ended.glsl"
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;
#include "variants/tile.glsl"

// The vertical sums, packed in the format of their image. They are stored in planes of words, so
// that neighbours are in neighbouring banks. With floats `Separable` takes 0.170 ms in place of 0.111
// (3840 x 2160 in float16, H200, 2026-11-27).
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

void end_run(ivec2 place, ivec2 last, inout vec3 run[RUN])
{
}

void end_row(int row, int column, bool starts, bool ends, inout vec3 sum)
{
}

vec4 shade(ivec2 pixel, vec3 sum)
{
    vec4 bloom = vec4(as_stored(sum, FORMAT), 1.0);
    return ended(texelFetch(image, pixel, 0), bloom, pixel);
}
