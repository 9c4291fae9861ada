// Pixels between an image and a buffer with another layout. With LAYERS for each image of a batch,
// whose number is that of the group along z.

layout(local_size_x = 128) in;

// struct vkb_strided_copy_layout, of the buffer; offsets and strides in bytes.
layout(push_constant) uniform Layout
{
    int offset, row_stride, pixel_stride, channel_stride;
    uint width, height;
    uint channels;
    uint size;    // of an element: 1, 2 or 4
    uint stores;  // 0: elements are only counted
    int layer_stride;
    uint aligned;  // pixels of four channels that begin with words, and whose elements are adjacent
    uint non_finite;  // enum vkb_non_finite_use
} layout_;
