// From a buffer with any strides to an image, and how many elements are NaN or infinite, unless
// these become 0. An invocation moves pixels of a column, whose loads do not wait for one another:
// those of a group are a tile, since drivers keep the pixels of a tile together.

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

const uint COUNTS_WORDS = 64;  // VKB_COUNTS_SIZE
// The invocations of a group, and the pixels of each: as in strided_copy.c.
const ivec2 GROUP = ivec2(16, 8);
const int PIXELS = 4;
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
    bool is_zero = magnitude > exponent || (magnitude == exponent && layout_.non_finite == IS_ZERO);
    return is_zero ? 0u : value;
}

// A channel that the buffer does not have is 1.
uint element(const uint size, uint place, uint channel)
{
    place += min(channel, layout_.channels - 1) * uint(layout_.channel_stride);
    uint word = from_words[place >> 2];
    uint value = size == 4 ? word : (word >> (8 * (place & 3))) & (size == 2 ? 0xffffu : 0xffu);
    uint one = size == 4 ? 0x3f800000u : size == 2 ? 0x3c00u : 255u;
    return channel < layout_.channels ? value : one;
}

// `size` and `aligned` are constants of each call.
uvec4 elements(const uint size, const bool aligned, uint place)
{
    uint word = place >> 2;

    if (!aligned)
        return uvec4(element(size, place, 0), element(size, place, 1), element(size, place, 2),
                     element(size, place, 3));
    uint first = from_words[word];
    if (size == 1)
        return (uvec4(first) >> uvec4(0, 8, 16, 24)) & 0xffu;
    uint second = from_words[word + 1];
    if (size == 2)
        return uvec4(first & 0xffffu, first >> 16, second & 0xffffu, second >> 16);
    return uvec4(first, second, from_words[word + 2], from_words[word + 3]);
}

float number(uint value)
{
    return layout_.size == 4 ? uintBitsToFloat(value)
         : layout_.size == 2 ? unpackHalf2x16(value).x
                             : float(value) / 255.0;
}

void move(const uint size, const bool aligned)
{
    int index = int(gl_LocalInvocationIndex), last = int(layout_.height) - 1;
    ivec2 at = GROUP * ivec2(1, PIXELS) * ivec2(gl_WorkGroupID.xy) + ivec2(index % GROUP.x, index / GROUP.x);
    int place = layout_.offset + int(gl_WorkGroupID.z) * layout_.layer_stride + at.x * layout_.pixel_stride;
    uvec4 raw[PIXELS];

    if (at.x >= int(layout_.width))
        return;
    [[unroll]] for (int i = 0; i < PIXELS; ++i)
        raw[i] = elements(size, aligned, uint(place + min(at.y + i * GROUP.y, last) * layout_.row_stride));
    [[unroll]] for (int i = 0; i < PIXELS; ++i) {
        ivec2 to = at + ivec2(0, i * GROUP.y);
        if (to.y > last)
            return;
        for (int channel = 0; channel < 4; ++channel)
            raw[i][channel] = count(raw[i][channel]);
        if (layout_.stores != 0)
            imageStore(to_image, to,
                       vec4(number(raw[i].x), number(raw[i].y), number(raw[i].z), number(raw[i].w)));
    }
}

void main()
{
    bool aligned = layout_.aligned != 0;

    if (layout_.size == 4 && aligned)
        move(4, true);
    else if (layout_.size == 4)
        move(4, false);
    else if (layout_.size == 2 && aligned)
        move(2, true);
    else if (layout_.size == 2)
        move(2, false);
    else if (aligned)
        move(1, true);
    else
        move(1, false);
    if (nan > 0)
        atomicAdd(counts[COUNTS_WORDS * gl_WorkGroupID.z], nan);
    if (infinite > 0)
        atomicAdd(counts[COUNTS_WORDS * gl_WorkGroupID.z + 1], infinite);
}
