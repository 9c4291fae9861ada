// Samples around the places in a source that the pixels of a target of another size fall on, clamped
// to the edge. A shader that includes this may define TEXEL to change what is read of a texel.

#ifndef TEXEL
#define TEXEL(value) (value)
#endif

// A texel, and how far beyond its centre the place lies, 0 to 1 texels.
struct Place {
    ivec2 texel;
    vec2 part;
};

// Where the centre of a target's pixel falls. In whole numbers, for a float position at the far end
// of a large image is off by so much that filtered values of neighbouring texels would show it;
// unsigned, so that sides of 32768 fit.
Place place_in_size(ivec2 source_size, ivec2 pixel, ivec2 target_size)
{
    uvec2 divisor = 2u * uvec2(target_size);
    // Places up to half a texel before the first texel's centre are negative: one texel is added here
    // and taken away below.
    uvec2 number = uvec2(2 * pixel + 1) * uvec2(source_size) + uvec2(target_size);
    uvec2 texel = number / divisor;
    return Place(ivec2(texel) - 1, vec2(number - texel * divisor) / vec2(divisor));
}

Place place_in(sampler2D source, ivec2 pixel, ivec2 target_size)
{
    return place_in_size(textureSize(source, 0), pixel, target_size);
}

// The place of this pixel, in a shader whose parameters hold SAMPLING_ROWS.
#define PLACE_IN(source) \
    place_in(source, PIXEL, ivec2(params.target_width, params.target_height))

vec4 fetch_clamped(sampler2D source, ivec2 texel)
{
    return TEXEL(texelFetch(source, clamp(texel, ivec2(0), textureSize(source, 0) - 1), 0));
}

// A texel and its neighbours to the right, below, and both.
vec4[4] fetch_four(sampler2D source, ivec2 texel)
{
    return vec4[4](fetch_clamped(source, texel), fetch_clamped(source, texel + ivec2(1, 0)),
                   fetch_clamped(source, texel + ivec2(0, 1)),
                   fetch_clamped(source, texel + ivec2(1, 1)));
}

// Bilinear in full float precision: hardware filters have 8 bits of position, or fewer.
vec4 bilinear(vec4 four[4], vec2 part)
{
    return mix(mix(four[0], four[1], part.x), mix(four[2], four[3], part.x), part.y);
}

vec4 fetch_bilinear(sampler2D source, ivec2 texel, vec2 part)
{
    return bilinear(fetch_four(source, texel), part);
}

// The same, never beyond its texels: rounding takes some pixels of a flat area off its value.
vec4 fetch_within(sampler2D source, Place place)
{
    vec4 four[4] = fetch_four(source, place.texel);
    vec4 low = min(min(four[0], four[1]), min(four[2], four[3]));
    vec4 high = max(max(four[0], four[1]), max(four[2], four[3]));
    return clamp(bilinear(four, place.part), low, high);
}

// The source at an offset, in texels, from a place.
vec4 sample_at(sampler2D source, Place place, vec2 offset, int sampling)
{
    if (sampling == SAMPLING_WHOLE)
        return fetch_clamped(source, place.texel + ivec2(offset));
    vec2 moved = place.part + offset;
    if (sampling == SAMPLING_FETCH) {
        vec2 whole = floor(moved);
        return fetch_bilinear(source, place.texel + ivec2(whole), moved - whole);
    }
    return texture(source, (vec2(place.texel) + 0.5 + moved) / vec2(textureSize(source, 0)));
}

// A source with a border of one texel on its left and right, at a pixel's own place.
vec4 sample_bordered(sampler2D source, ivec2 pixel, ivec2 target_size, int sampling)
{
    ivec2 size = textureSize(source, 0) - ivec2(2, 0);
    if (sampling == SAMPLING_FILTER) {
        // The sampler's 8 bits of position ask for no whole numbers, whose division is slow.
        vec2 at = (vec2(pixel) + 0.5) * (vec2(size) / vec2(target_size));
        return texture(source, (at + vec2(1.0, 0.0)) / vec2(textureSize(source, 0)));
    }
    Place place = place_in_size(size, pixel, target_size);
    place.texel.x += 1;
    return sample_at(source, place, vec2(0.0), sampling);
}
