// Elements from one layout to another, and how many of them are NaN or infinite. By default from a
// buffer with any strides to a dense buffer; with TO_IMAGE to an image, with FROM_IMAGE from one. With
// LAYERS for each image of a batch, whose number is that of the workgroup along z.

layout(local_size_x = 128) in;

#ifdef LAYERS
#define SAMPLED sampler2DArray
#define STORED image2DArray
#define AT(place) ivec3(place, gl_WorkGroupID.z)
#else
#define SAMPLED sampler2D
#define STORED image2D
#define AT(place) (place)
#endif

#ifdef FROM_IMAGE
layout(binding = 0) uniform SAMPLED from_image;
#else
layout(std430, binding = 0) readonly buffer From
{
    uint from_words[];
};
#endif

#ifdef TO_IMAGE
layout(binding = 1) uniform writeonly STORED to_image;
#else
layout(std430, binding = 1) writeonly buffer To
{
    uint to_words[];
};
#endif

layout(std430, binding = 2) buffer Counts
{
    uint counts[];  // NaN, infinity
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
    int layer_stride;
} layout_;

shared uint sums[2];

#ifdef FROM_IMAGE
uint element(uint pixel, uint channel)
{
    ivec2 place = ivec2(pixel % layout_.width, pixel / layout_.width);
    float value = texelFetch(from_image, AT(place), 0)[channel];
    return layout_.size == 4 ? floatBitsToUint(value)
         : layout_.size == 2 ? packHalf2x16(vec2(value, 0))
                             : uint(value * 255.0 + 0.5);
}
#else
uint element(uint pixel, uint channel)
{
    if (channel >= layout_.from_channels)
        return layout_.one;
    int y = int(pixel / layout_.width), x = int(pixel % layout_.width);
    uint place = uint(layout_.offset + int(gl_WorkGroupID.z) * layout_.layer_stride
                      + y * layout_.row_stride + x * layout_.pixel_stride
                      + int(channel) * layout_.channel_stride);
    uint word = from_words[place >> 2];
    return layout_.size == 4 ? word
         : (word >> (8 * (place & 3))) & (layout_.size == 2 ? 0xffffu : 0xffu);
}
#endif

const uint COUNTS_WORDS = 64;  // VKB_COUNTS_SIZE

// What one invocation moves, and its number.
uint invocation = gl_GlobalInvocationID.x
                + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x;
uint nan = 0, infinite = 0;

void count(uint value)
{
    uint exponent = layout_.size == 4 ? 0x7f800000u : 0x7c00u;
    uint magnitude = value & (layout_.size == 4 ? 0x7fffffffu : 0x7fffu);

    nan += uint(magnitude > exponent);
    infinite += uint(magnitude == exponent);
}

#ifdef TO_IMAGE
float number(uint value)
{
    return layout_.size == 4 ? uintBitsToFloat(value)
         : layout_.size == 2 ? unpackHalf2x16(value).x
                             : float(value) / 255.0;
}

void move()
{
    vec4 colour;

    if (invocation >= layout_.width * layout_.height)
        return;
    for (uint channel = 0; channel < 4; ++channel) {
        uint value = element(invocation, channel);
        count(value);
        colour[channel] = number(value);
    }
    if (layout_.stores != 0)
        imageStore(to_image, AT(ivec2(invocation % layout_.width, invocation / layout_.width)),
                   colour);
}
#else
void move()
{
    uint per_word = 4 / layout_.size, packed = 0;
    uint total = layout_.width * layout_.height * layout_.channels;

    for (uint i = 0; i < per_word; ++i) {
        uint index = invocation * per_word + i;
        if (index < total) {
            uint value = element(index / layout_.channels, index % layout_.channels);
            count(value);
            packed |= value << (8 * layout_.size * i);
        }
    }
    if (layout_.stores != 0 && invocation * per_word < total)
        to_words[invocation + gl_WorkGroupID.z * (uint(layout_.layer_stride) >> 2)] = packed;
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
    if (layout_.is_float != 0 && nan + infinite > 0) {
        atomicAdd(sums[0], nan);
        atomicAdd(sums[1], infinite);
    }
    barrier();
    if (gl_LocalInvocationIndex == 0 && sums[0] + sums[1] > 0) {
        atomicAdd(counts[COUNTS_WORDS * gl_WorkGroupID.z], sums[0]);
        atomicAdd(counts[COUNTS_WORDS * gl_WorkGroupID.z + 1], sums[1]);
    }
}
