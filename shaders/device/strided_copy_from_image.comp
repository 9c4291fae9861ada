// From an image to a dense buffer. An invocation stores 16 bytes.

#include "device/strided_copy.glsl"

layout(binding = 0) uniform sampler2D from_image;

layout(std430, binding = 1) writeonly buffer To
{
    uvec4 to_words[];
};

// The pixel and the channel of the next element.
ivec2 at;
uint channel;
vec4 texel;

uint own_element()
{
    float value = channel == 0 ? texel.r
                : channel == 1 ? texel.g
                : channel == 2 ? texel.b
                               : texel.a;
    return layout_.size == 4 ? floatBitsToUint(value)
         : layout_.size == 2 ? packHalf2x16(vec2(value, 0))
                             : uint(value * 255.0 + 0.5);
}

void leave_pixel()
{
    channel = 0;
    at = at.x + 1 < int(layout_.width) ? at + ivec2(1, 0) : ivec2(0, at.y + 1);
    if (at.y < int(layout_.height))
        texel = texelFetch(from_image, at, 0);
}

// The next element; behind the last one, 0.
uint next_element()
{
    if (channel == layout_.channels)
        leave_pixel();
    if (at.y >= int(layout_.height))
        return 0;
    uint value = own_element();
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

uvec4 next_words()
{
    uvec4 words;

    words.x = next_word();
    words.y = next_word();
    words.z = next_word();
    words.w = next_word();
    return words;
}

void main()
{
    uint invocation = gl_GlobalInvocationID.x
                    + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    uint index = invocation * (16 / layout_.size), pixel = index / layout_.channels;

    if (pixel >= layout_.width * layout_.height)
        return;
    at = ivec2(pixel % layout_.width, pixel / layout_.width);
    channel = index % layout_.channels;
    texel = texelFetch(from_image, at, 0);
    to_words[invocation + gl_WorkGroupID.z * (uint(layout_.layer_stride) >> 4)] = next_words();
}
