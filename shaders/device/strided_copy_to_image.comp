// From a buffer with any strides to an image, and how many elements are NaN or infinite, unless
// these become 0. An invocation moves a pixel: those of a group are a tile, since drivers keep the
// pixels of a tile together.

#include "device/strided_copy.glsl"

layout(std430, binding = 0) readonly buffer From
{
    uint from_words[];
};

layout(binding = 1) uniform writeonly image2D to_image;

layout(std430, binding = 2) buffer Counts
{
    uint counts[];  // NaN, infinity
};

shared uint sums[2];

const uint COUNTS_WORDS = 64;         // VKB_COUNTS_SIZE
const ivec2 TILE = ivec2(16, 8);  // as in strided_copy.c
// enum vkb_non_finite_use
const uint COUNTED = 0, IS_ZERO = 2;

uint nan = 0, infinite = 0;

// Returns the element that is stored.
uint count(uint value)
{
    if (layout_.size == 1)
        return value;
    uint exponent = layout_.size == 4 ? 0x7f800000u : 0x7c00u;
    uint magnitude = value & (layout_.size == 4 ? 0x7fffffffu : 0x7fffu);

    if (layout_.non_finite == COUNTED) {
        nan += uint(magnitude > exponent);
        infinite += uint(magnitude == exponent);
        return value;
    }
    bool is_zero = magnitude > exponent
                || (magnitude == exponent && layout_.non_finite == IS_ZERO);
    return is_zero ? 0u : value;
}

// A channel that the buffer does not have is 1.
uint element(uint pixel_place, uint channel)
{
    if (channel >= layout_.channels)
        return layout_.size == 4 ? 0x3f800000u : layout_.size == 2 ? 0x3c00u : 255u;
    uint place = pixel_place + channel * uint(layout_.channel_stride);
    uint word = from_words[place >> 2];
    return layout_.size == 4 ? word
         : (word >> (8 * (place & 3))) & (layout_.size == 2 ? 0xffffu : 0xffu);
}

uvec4 elements(uint place)
{
    uint word = place >> 2;

    if (layout_.aligned == 0)
        return uvec4(element(place, 0), element(place, 1), element(place, 2), element(place, 3));
    uint first = from_words[word];
    if (layout_.size == 1)
        return (uvec4(first) >> uvec4(0, 8, 16, 24)) & 0xffu;
    uint second = from_words[word + 1];
    if (layout_.size == 2)
        return uvec4(first & 0xffffu, first >> 16, second & 0xffffu, second >> 16);
    return uvec4(first, second, from_words[word + 2], from_words[word + 3]);
}

float number(uint value)
{
    return layout_.size == 4 ? uintBitsToFloat(value)
         : layout_.size == 2 ? unpackHalf2x16(value).x
                             : float(value) / 255.0;
}

void move()
{
    int index = int(gl_LocalInvocationIndex);
    ivec2 at = TILE * ivec2(gl_WorkGroupID.xy) + ivec2(index % TILE.x, index / TILE.x);
    if (at.x >= int(layout_.width) || at.y >= int(layout_.height))
        return;
    uvec4 raw = elements(uint(layout_.offset + int(gl_WorkGroupID.z) * layout_.layer_stride
                              + at.y * layout_.row_stride + at.x * layout_.pixel_stride));
    for (int channel = 0; channel < 4; ++channel)
        raw[channel] = count(raw[channel]);
    if (layout_.stores != 0)
        imageStore(to_image, at,
                   vec4(number(raw.x), number(raw.y), number(raw.z), number(raw.w)));
}

void main()
{
    uint kind = gl_LocalInvocationIndex;

    if (kind < 2)
        sums[kind] = 0;
    barrier();
    move();
    if (nan + infinite > 0) {
        atomicAdd(sums[0], nan);
        atomicAdd(sums[1], infinite);
    }
    barrier();
    if (kind < 2 && sums[kind] > 0)
        atomicAdd(counts[COUNTS_WORDS * gl_WorkGroupID.z + kind], sums[kind]);
}
