// A filter in tiles (variants/nested.glsl).
#include "variants/nested.glsl"

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_SAME_SIZE, same_size);
#ifdef FINAL
SAMPLED_IMAGE(SLOT_ENDED, scene);
#include "lib/ended.glsl"
#endif
layout(set = 0, binding = TARGET_BINDING) uniform writeonly image2D target;
const bool TURNED = false, REPEATS = EXACT != 0;
#include "variants/filter_tile.glsl"

Window window_at(int picture, int pixel, bool along_x)
{
    return window_in(textureSize(source, 0), ivec2(pixel), along_x);
}

vec4 texel_at(ivec2 texel)
{
    return seen(fetch_clamped(source, texel + ivec2(params.first_x, params.first_y)));
}

vec4 same_size_at(ivec2 pixel)
{
    return ADDS_IMAGE != 0 ? texelFetch(same_size, pixel, 0) : vec4(0.0);
}

#ifdef FINAL
vec4 added_at(ivec2 pixel)
{
    return texelFetch(scene, pixel, 0);
}
#else
vec4 added_at(ivec2 pixel)
{
    return same_size_at(pixel);
}
#endif

vec4 shade(vec4 own, vec4 sum, ivec2 pixel)
{
    sum = params.coarse * (sum / params.divisor);
#ifdef FINAL
    if (ADDS_IMAGE != 0)
        sum += params.same_size * same_size_at(pixel);
    return ended(own, as_stored(sum, FORMAT), pixel);
#else
    if (ADDS_IMAGE != 0)
        sum += params.same_size * own;
    return stored(sum);
#endif
}
