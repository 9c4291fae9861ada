#version 450
#extension GL_GOOGLE_include_directive : require
// Upsampling in the pyramid: adds the share of the level itself and that of the upsampled smaller
// level.
#include "lib/block.glsl"
#include "lib/sampling.glsl"
#include "lib/cubic.glsl"

UNIFORM_BLOCK(PYRAMID_BLOCK);
#include "lib/storage.glsl"
#include "lib/doubling.glsl"

layout(set = 0, binding = 1) uniform sampler2D smaller;
layout(set = 0, binding = 2) uniform sampler2D own;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"

// 3 x 3 taps with the weights (1 2 1)^2 / 16.
vec4 tent(Place place)
{
    vec4 sum = vec4(0.0);
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
            vec2 offset = vec2(params.step_x, params.step_y) * vec2(x, y);
            float weight = (2.0 - abs(float(x))) * (2.0 - abs(float(y))) / 16.0;
            sum += weight * sample_at(smaller, place, offset, SAMPLING);
        }
    return sum;
}

// HDRP's border: positions are limited to the middle of the last two texels, taps of the bicubic
// filter to 1 - 1 / size of the target.
vec4 upsample_inset(Place place)
{
    ivec2 size = textureSize(smaller, 0);
    bvec2 beyond = greaterThan(vec2(place.texel - size + 2) + place.part, vec2(0.5));
    Place kept = Place(mix(place.texel, size - 2, beyond), mix(place.part, vec2(0.5), beyond));
    if (UPSAMPLE == UPSAMPLE_INSET_LINEAR)
        return sample_at(smaller, kept, vec2(0.0), SAMPLING);
    vec2 ratio = vec2(COMPLETE_SIZE(smaller)) / vec2(params.target_width, params.target_height);
    vec2 furthest = vec2(size - 1 - kept.texel) + 0.5 - ratio;
    return sample_cubic_within(smaller, kept, furthest, SAMPLING);
}

// The same, or one bilinear tap, for a level of exactly twice the size of the smaller one.
vec4 doubled()
{
    ivec2 first = (PIXEL + 1) / 2 - 2;
    vec4 rows[4];
    for (int y = 0; y < 4; ++y) {
        vec4 texels[4];
        for (int x = 0; x < 4; ++x)
            texels[x] = fetch_clamped(smaller, first + ivec2(x, y));
        rows[y] = four(texels[0], texels[1], texels[2], texels[3], (PIXEL.x & 1) == 1);
    }
    return four(rows[0], rows[1], rows[2], rows[3], (PIXEL.y & 1) == 1);
}

vec4 upsample(Place place)
{
    if (SAMPLING == SAMPLING_TEXEL)
        return doubled();
    if (UPSAMPLE == UPSAMPLE_LINEAR)
        return sample_at(smaller, place, vec2(0.0), SAMPLING);
    if (UPSAMPLE == UPSAMPLE_CUBIC)
        return sample_cubic(smaller, place);
    if (UPSAMPLE == UPSAMPLE_INSET_LINEAR || UPSAMPLE == UPSAMPLE_INSET_CUBIC)
        return upsample_inset(place);
    return tent(place);
}

vec4 shade()
{
    vec4 sum = params.coarse * upsample(PLACE_IN(smaller));
    if (ADD_OWN != 0)
        sum += params.own * texelFetch(own, PIXEL, 0);
    return stored(sum);
}
