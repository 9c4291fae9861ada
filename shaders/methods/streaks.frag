// One iteration of a streak in one direction: taps at multiples of a step (Kawase, "Frame Buffer
// Postprocessing Effects in DOUBLE-S.T.E.A.L", GDC 2003). The last one adds the streaks before.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(STREAKS_BLOCK);
#include "lib/fetch_inside.glsl"

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_BEFORE, before);

#include "lib/fullscreen.glsl"

vec4 fetch(ivec2 texel)
{
    vec4 value = fetch_inside(source, texel);
    return PART_ABOVE != 0 ? part_above(value, params.threshold) : value;
}

vec4 fetch_in_row(ivec2 texel, float part)
{
    vec4 value = fetch(texel);
    return part > 0.0 ? blended(value, fetch(texel + ivec2(1, 0)), part) : value;
}

// Steps along an axis, and many others, are of integer texels: then half of the fetches, or three of
// four, would have no weight.
vec4 sample_moved(int tap)
{
    vec2 offset = float(tap) * vec2(params.step_x, params.step_y);
    vec2 integer = floor(offset), part = offset - integer;
    ivec2 texel = PIXEL + ivec2(integer);
    if (params.reads_next != 0)
        texel = next_texel(source, texel, params.next[tap]);
    vec4 value = fetch_in_row(texel, part.x);
    return part.y > 0.0 ? blended(value, fetch_in_row(texel + ivec2(0, 1), part.x), part.y) : value;
}

vec4 shade()
{
    vec4 sum = ADDS_IMAGE != 0 ? texelFetch(before, PIXEL, 0) : vec4(0.0);
    for (int tap = 0; tap < params.count; ++tap)
        sum += params.weights[tap] * sample_moved(tap);
    return stored(sum);
}
