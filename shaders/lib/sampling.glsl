// Samples a source at the positions of the pixels of a target of another size, clamped to the edge.
// The including shader may define TEXEL to convert every texel that is read.

#ifndef TEXEL
#define TEXEL(value) (value)
#endif

// A position in a source: a texel, and the offset from its centre, 0 to 1 texels.
struct Place {
    ivec2 texel;
    vec2 part;
};

// The position of the centre of a target's pixel. Integers, since a float position at the far end of a large image is too inaccurate for filtering.
// Unsigned, so that sides of 32768 fit.
Place place_in_size(ivec2 source_size, ivec2 pixel, ivec2 target_size)
{
    uvec2 divisor = 2u * uvec2(target_size);
    // Positions before the first texel's centre would be negative: add one texel here, and subtract
    // it below.
    uvec2 number = uvec2(2 * pixel + 1) * uvec2(source_size) + uvec2(target_size);
    uvec2 texel = number / divisor;
    return Place(ivec2(texel) - 1, vec2(number - texel * divisor) / vec2(divisor));
}

Place place_in(sampler2D source, ivec2 pixel, ivec2 target_size)
{
    return place_in_size(textureSize(source, 0), pixel, target_size);
}

// The position of this pixel in the source, for a shader whose block has SAMPLING_ROWS.
#define PLACE_IN(source) place_in(source, PIXEL, ivec2(params.target_width, params.target_height))

// The step to the texel after the one at a place, which Blender 5.2 reads at some (vkb_next_bits):
// for 0 by bit 0, for 2^k by bit k + 1. Rows are counted from the bottom.
int next_step(int texel, float bits)
{
    bool has_bit = texel >= 0 && (texel & (texel - 1)) == 0;
    return has_bit ? int(bits) >> (findMSB(texel) + 1) & 1 : 0;
}

ivec2 next_texel(sampler2D source, ivec2 texel, vec4 bits)
{
    int row = textureSize(source, 0).y - 1 - texel.y;
    return texel + ivec2(next_step(texel.x, bits.x), -next_step(row, bits.y));
}

vec4 fetch_clamped(sampler2D source, ivec2 texel)
{
    return TEXEL(texelFetch(source, clamp(texel, ivec2(0), textureSize(source, 0) - 1), 0));
}

// A texel and its neighbours to the right, below, and below right.
vec4[4] fetch_four(sampler2D source, ivec2 texel)
{
    return vec4[4](fetch_clamped(source, texel), fetch_clamped(source, texel + ivec2(1, 0)),
                   fetch_clamped(source, texel + ivec2(0, 1)),
                   fetch_clamped(source, texel + ivec2(1, 1)));
}

// Like mix(), for which compilers have several formulas that round differently.
vec4 blended(vec4 a, vec4 b, float part)
{
    return (1.0 - part) * a + part * b;
}

// Bilinear filter in float precision. Hardware filters use 8 bits of the position, or fewer.
vec4 bilinear(vec4 four[4], vec2 part)
{
    return blended(blended(four[0], four[1], part.x), blended(four[2], four[3], part.x), part.y);
}

vec4 fetch_bilinear(sampler2D source, ivec2 texel, vec2 part)
{
    return bilinear(fetch_four(source, texel), part);
}

// The same, clamped to the range of its texels: rounding would change some pixels of a flat area.
vec4 fetch_within(sampler2D source, Place place)
{
    vec4 four[4] = fetch_four(source, place.texel);
    vec4 low = min(min(four[0], four[1]), min(four[2], four[3]));
    vec4 high = max(max(four[0], four[1]), max(four[2], four[3]));
    return clamp(bilinear(four, place.part), low, high);
}

// Samples the source at an offset, in texels, from a position.
vec4 sample_at(sampler2D source, Place place, vec2 offset, int sampling)
{
    if (sampling == SAMPLING_TEXEL)
        return fetch_clamped(source, place.texel + ivec2(offset));
    vec2 moved = place.part + offset;
    if (sampling == SAMPLING_FETCH) {
        vec2 integer = floor(moved);
        return fetch_bilinear(source, place.texel + ivec2(integer), moved - integer);
    }
    return texture(source, (vec2(place.texel) + 0.5 + moved) / vec2(textureSize(source, 0)));
}

// Samples a source that has a border of one texel on its left and right, at a pixel's position.
vec4 sample_bordered(sampler2D source, ivec2 pixel, ivec2 target_size, int sampling)
{
    ivec2 size = textureSize(source, 0) - ivec2(2, 0);
    if (sampling == SAMPLING_FILTER) {
        // Float precision is enough for the sampler's 8 bits; integer division is slow.
        vec2 at = (vec2(pixel) + 0.5) * (vec2(size) / vec2(target_size));
        return texture(source, (at + vec2(1.0, 0.0)) / vec2(textureSize(source, 0)));
    }
    Place place = place_in_size(size, pixel, target_size);
    place.texel.x += 1;
    return sample_at(source, place, vec2(0.0), sampling);
}
