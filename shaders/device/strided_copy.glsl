// Elements from one layout to another, and how many of them are NaN or infinite. By default from a
// buffer with any strides to a dense buffer; with TO_IMAGE to an image, with FROM_IMAGE from one.
// With LAYERS for each image of a batch, whose number is that of the group along z. An invocation
// moves 16 bytes to a buffer, or a pixel to an image: those of a group are a tile, since drivers
// keep the pixels of a tile together.

#include "lib/layers.glsl"

layout(local_size_x = 128) in;

#ifdef FROM_IMAGE
layout(binding = 0) uniform sampler2D from_image;
#else
layout(std430, binding = 0) readonly buffer From
{
    uint from_words[];
};
#endif

#ifdef TO_IMAGE
layout(binding = 1) uniform writeonly image2D to_image;
#else
layout(std430, binding = 1) writeonly buffer To
{
    uvec4 to_words[];
};
#endif

layout(std430, binding = 2) buffer Counts
{
    uint counts[];  // NaN, infinity
};

// struct vkb_strided_copy_layout; offsets and strides in bytes.
layout(push_constant) uniform Layout
{
    int offset, row_stride, pixel_stride, channel_stride;
    uint width, height;
    uint channels, from_channels;
    uint size;      // of an element: 1, 2 or 4
    uint one;       // the element of a channel that is not there
    uint stores;    // 0: elements are only counted
    uint is_float;
    int layer_stride;
    uint aligned;  // pixels of four channels that begin with words, and whose elements are adjacent
} layout_;

shared uint sums[2];

const uint COUNTS_WORDS = 64;  // VKB_COUNTS_SIZE

uint nan = 0, infinite = 0;

void count(uint value)
{
    if (layout_.is_float == 0)
        return;
    uint exponent = layout_.size == 4 ? 0x7f800000u : 0x7c00u;
    uint magnitude = value & (layout_.size == 4 ? 0x7fffffffu : 0x7fffu);

    nan += uint(magnitude > exponent);
    infinite += uint(magnitude == exponent);
}

#ifndef FROM_IMAGE
uint place_of(ivec2 at)
{
    return uint(layout_.offset + int(gl_WorkGroupID.z) * layout_.layer_stride
                + at.y * layout_.row_stride + at.x * layout_.pixel_stride);
}

uint element(uint pixel_place, uint channel)
{
    if (channel >= layout_.from_channels)
        return layout_.one;
    uint place = pixel_place + channel * uint(layout_.channel_stride);
    uint word = from_words[place >> 2];
    return layout_.size == 4 ? word
         : (word >> (8 * (place & 3))) & (layout_.size == 2 ? 0xffffu : 0xffu);
}
#endif

#ifdef TO_IMAGE
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

const ivec2 TILE = ivec2(16, 8);  // as in strided_copy.c

void move()
{
    int index = int(gl_LocalInvocationIndex);
    ivec2 at = TILE * ivec2(gl_WorkGroupID.xy) + ivec2(index % TILE.x, index / TILE.x);
    if (at.x >= int(layout_.width) || at.y >= int(layout_.height))
        return;
    uvec4 raw = elements(place_of(at));
    for (int channel = 0; channel < 4; ++channel)
        count(raw[channel]);
    if (layout_.stores != 0)
        imageStore(to_image, at,
                   vec4(number(raw.x), number(raw.y), number(raw.z), number(raw.w)));
}
#else
// The pixel and the channel of the next element.
ivec2 at;
uint channel;
#ifdef FROM_IMAGE
vec4 texel;
#else
uint pixel_place;
#endif

void enter_pixel()
{
#ifdef FROM_IMAGE
    texel = texelFetch(from_image, at, 0);
#else
    pixel_place = place_of(at);
#endif
}

uint own_element()
{
#ifdef FROM_IMAGE
    float value = channel == 0 ? texel.r
                : channel == 1 ? texel.g
                : channel == 2 ? texel.b
                               : texel.a;
    return layout_.size == 4 ? floatBitsToUint(value)
         : layout_.size == 2 ? packHalf2x16(vec2(value, 0))
                             : uint(value * 255.0 + 0.5);
#else
    return element(pixel_place, channel);
#endif
}

void leave_pixel()
{
    channel = 0;
    at = at.x + 1 < int(layout_.width) ? at + ivec2(1, 0) : ivec2(0, at.y + 1);
    if (at.y < int(layout_.height))
        enter_pixel();
}

// The next element; behind the last one, 0.
uint next_element()
{
    if (channel == layout_.channels)
        leave_pixel();
    if (at.y >= int(layout_.height))
        return 0;
    uint value = own_element();
    count(value);
    ++channel;
    return value;
}

uint next_word()
{
    uint word = next_element();

    if (layout_.size == 4)
        return word;
    if (layout_.size == 2)
        return word | next_element() << 16;
    word |= next_element() << 8;
    word |= next_element() << 16;
    return word | next_element() << 24;
}

#ifdef FROM_IMAGE
// Of pixels of four channels; their content behind the last one is of no account.
uvec4 complete_pixels()
{
    uvec4 words;

    if (layout_.size == 4)
        return floatBitsToUint(texel);
    if (layout_.size == 2) {
        words.xy = uvec2(packHalf2x16(texel.xy), packHalf2x16(texel.zw));
        leave_pixel();
        words.zw = uvec2(packHalf2x16(texel.xy), packHalf2x16(texel.zw));
        return words;
    }
    words.x = packUnorm4x8(texel);
    leave_pixel();
    words.y = packUnorm4x8(texel);
    leave_pixel();
    words.z = packUnorm4x8(texel);
    leave_pixel();
    words.w = packUnorm4x8(texel);
    return words;
}
#endif

uvec4 next_words()
{
    uvec4 words;

    words.x = next_word();
    words.y = next_word();
    words.z = next_word();
    words.w = next_word();
    return words;
}

void move()
{
    uint invocation = gl_GlobalInvocationID.x
                    + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    uint index = invocation * (16 / layout_.size), pixel = index / layout_.channels;

    if (pixel >= layout_.width * layout_.height)
        return;
    at = ivec2(pixel % layout_.width, pixel / layout_.width);
    channel = index % layout_.channels;
    enter_pixel();
#ifdef FROM_IMAGE
    uvec4 words = layout_.channels == 4 ? complete_pixels() : next_words();
#else
    uvec4 words = next_words();
#endif
    if (layout_.stores != 0)
        to_words[invocation + gl_WorkGroupID.z * (uint(layout_.layer_stride) >> 4)] = words;
}
#endif

void main()
{
    if (gl_LocalInvocationIndex == 0) {
        sums[0] = 0;
        sums[1] = 0;
    }
    barrier();
    move();
    if (nan + infinite > 0) {
        atomicAdd(sums[0], nan);
        atomicAdd(sums[1], infinite);
    }
    barrier();
    if (gl_LocalInvocationIndex == 0 && sums[0] + sums[1] > 0) {
        atomicAdd(counts[COUNTS_WORDS * gl_WorkGroupID.z], sums[0]);
        atomicAdd(counts[COUNTS_WORDS * gl_WorkGroupID.z + 1], sums[1]);
    }
}
