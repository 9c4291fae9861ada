#version 450

// Elements from any strides to a dense buffer, and how many of them are NaN or infinite.

layout(local_size_x = 128) in;

layout(std430, binding = 0) readonly buffer From
{
    uint from_words[];
};

layout(std430, binding = 1) writeonly buffer To
{
    uint to_words[];
};

layout(std430, binding = 2) buffer Counts
{
    uint counts[2];  // NaN, infinity
};

// struct vkb_gather_layout; offsets and strides in bytes.
layout(push_constant) uniform Layout
{
    int offset, row_stride, pixel_stride, channel_stride;
    uint width, height;
    uint channels, from_channels;
    uint size;      // of an element: 1, 2 or 4
    uint one;       // the element of a channel that is not there
    uint stores;    // 0: elements are only counted
    uint is_float;
} layout_;

shared uint sums[2];

uint element(uint pixel, uint channel)
{
    if (channel >= layout_.from_channels)
        return layout_.one;
    int y = int(pixel / layout_.width), x = int(pixel % layout_.width);
    uint place = uint(layout_.offset + y * layout_.row_stride + x * layout_.pixel_stride
                      + int(channel) * layout_.channel_stride);
    uint word = from_words[place >> 2];
    return layout_.size == 4 ? word
         : (word >> (8 * (place & 3))) & (layout_.size == 2 ? 0xffffu : 0xffu);
}

void main()
{
    uint word = gl_GlobalInvocationID.x
              + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    uint per_word = 4 / layout_.size;
    uint count = layout_.width * layout_.height * layout_.channels;
    uint exponent = layout_.size == 4 ? 0x7f800000u : 0x7c00u;
    uint magnitude = layout_.size == 4 ? 0x7fffffffu : 0x7fffu;
    uint packed = 0, nan = 0, infinite = 0;

    if (gl_LocalInvocationIndex == 0) {
        sums[0] = 0;
        sums[1] = 0;
    }
    barrier();
    for (uint i = 0; i < per_word; ++i) {
        uint index = word * per_word + i;
        if (index < count) {
            uint value = element(index / layout_.channels, index % layout_.channels);
            packed |= value << (8 * layout_.size * i);
            nan += uint((value & magnitude) > exponent);
            infinite += uint((value & magnitude) == exponent);
        }
    }
    if (layout_.stores != 0 && word * per_word < count)
        to_words[word] = packed;
    if (layout_.is_float != 0 && nan + infinite > 0) {
        atomicAdd(sums[0], nan);
        atomicAdd(sums[1], infinite);
    }
    barrier();
    if (gl_LocalInvocationIndex == 0 && sums[0] + sums[1] > 0) {
        atomicAdd(counts[0], sums[0]);
        atomicAdd(counts[1], sums[1]);
    }
}
