// A step of a mean: what a pixel counts as, sums of blocks, Granite's levels, HDRP's points.
#include "lib/exposure.glsl"

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_METER_MASK, meter_mask);

#include "lib/fullscreen.glsl"
#include "lib/sampling.glsl"

float measure(vec3 colour)
{
    if (ENGINE == EXPOSURE_O3DE)
        return luminance(colour);
    return ENGINE == EXPOSURE_GRANITE ? logarithm(brightest(colour) + 1e-4) : brightest(colour);
}

// The sum of a block, or its mean, by rows: fewer numbers are added to large sums.
vec4 sum_block(bool of_light)
{
    ivec2 size = textureSize(source, 0), first = METER_BLOCK * PIXEL;
    ivec2 count = min(ivec2(METER_BLOCK), size - first);
    vec4 sum = vec4(0.0);
    for (int y = 0; y < count.y; ++y) {
        vec4 row = vec4(0.0);
        for (int x = 0; x < count.x; ++x) {
            vec4 texel = texelFetch(source, first + ivec2(x, y), 0);
            row += of_light ? vec4(measure(texel.rgb)) : texel;
        }
        sum += row;
    }
    return ENGINE == EXPOSURE_GODOT ? sum / float(count.x * count.y) : sum;
}

vec4 level()
{
    ivec2 size = ivec2(params.width, params.height);
    Place place = place_in(source, PIXEL, size);
    vec4 sum = vec4(0.0);
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
            float weight = (x == 0 ? 0.5 : 0.25) * (y == 0 ? 0.5 : 0.25);
            sum += weight * sample_at(source, place, 1.75 * vec2(x, y), SAMPLING_FETCH);
        }
    return sum;
}

vec4 samples()
{
    ivec2 size = ivec2(params.width, params.height);
    Place place = place_in(source, PIXEL, size);
    vec4 value = fetch_bilinear(source, place.texel, place.part);
    return params.channel != 0 ? value : vec4(measure(value.rgb));
}

float mask_at(ivec2 point)
{
    if (params.masked == 0.0)
        return 1.0;
    vec2 place = vec2(point) / float(METER_POINTS) * vec2(textureSize(meter_mask, 0)) - 0.5, first = floor(place);
    return fetch_bilinear(meter_mask, ivec2(first), place - first).r;
}

// The sums of weights times EV100, and of weights, of a tile of points; 1 and 1 if the first is not finite.
vec4 points()
{
    vec2 sum = vec2(0.0);
    for (int y = 0; y < METER_TILE_POINTS; ++y) {
        vec2 row = vec2(0.0);
        for (int x = 0; x < METER_TILE_POINTS; ++x) {
            ivec2 point = METER_TILE_POINTS * PIXEL + ivec2(x, y);
            Place place = place_in(source, point, ivec2(METER_POINTS));
            float light = luminance(fetch_bilinear(source, place.texel, place.part).rgb);
            float weight = weight_at(vec2(point), vec2(METER_POINTS), light, mask_at(point));
            row += vec2(weight * ev100(larger_number(light, 1e-4)), weight);
        }
        sum += row;
    }
    return is_number(sum.x) ? vec4(sum, 0.0, 1.0) : vec4(1.0);
}

vec4 shade()
{
    if (METER == METER_LEVEL)
        return level();
    if (METER == METER_SAMPLES)
        return samples();
    if (METER == METER_LIGHT && ENGINE == EXPOSURE_AUTOMATIC)
        return points();
    return sum_block(METER == METER_LIGHT);
}
