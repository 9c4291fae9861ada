// From an image to a dense buffer. An invocation moves the pixels of as many words of 16 bytes as
// they have channels, so that its loads and stores do not wait for one another.

#include "device/strided_copy.glsl"

layout(binding = 0) uniform sampler2D from_image;

layout(std430, binding = 1) writeonly buffer To
{
    uvec4 to_words[];
};

// The pixels of an invocation whose elements have `size` bytes.
#define RUN(size) (16 / (size))

vec4 texels[RUN(1)];

float element(const uint channels, uint index)
{
    return texels[index / channels][index % channels];
}

uint word(const uint size, const uint channels, uint index)
{
    uint first = index * (4 / size);

    if (size == 4)
        return floatBitsToUint(element(channels, first));
    if (size == 2)
        return packHalf2x16(vec2(element(channels, first), element(channels, first + 1)));
    uint bytes = 0;
    [[unroll]] for (uint i = 0; i < 4; ++i)
        bytes |= uint(element(channels, first + i) * 255.0 + 0.5) << (8 * i);
    return bytes;
}

// The arguments are constants of each call.
void move(const uint size, const uint channels, uint run)
{
    uint pixel = run * RUN(size);
    uint end = (layout_.width * layout_.height * channels * size + 15) / 16;
    uint start = run * channels;
    ivec2 at = ivec2(pixel % layout_.width, pixel / layout_.width);

    [[unroll]] for (int i = 0; i < RUN(size); ++i) {
        texels[i] = texelFetch(from_image, min(at, ivec2(layout_.width, layout_.height) - 1), 0);
        at = at.x + 1 < int(layout_.width) ? at + ivec2(1, 0) : ivec2(0, at.y + 1);
    }
    [[unroll]] for (uint i = 0; i < channels; ++i)
        if (start + i < end)
            to_words[start + i + gl_WorkGroupID.z * (uint(layout_.layer_stride) >> 4)] =
                uvec4(word(size, channels, 4 * i), word(size, channels, 4 * i + 1),
                      word(size, channels, 4 * i + 2), word(size, channels, 4 * i + 3));
}

#define MOVE_CHANNELS(size) \
    if (layout_.channels == 4) \
        move(size, 4, run); \
    else if (layout_.channels == 3) \
        move(size, 3, run); \
    else \
        move(size, 1, run)

void main()
{
    uint run = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x;

    if (run * RUN(layout_.size) >= layout_.width * layout_.height)
        return;
    if (layout_.size == 4) {
        MOVE_CHANNELS(4);
    } else if (layout_.size == 2) {
        MOVE_CHANNELS(2);
    } else {
        MOVE_CHANNELS(1);
    }
}
