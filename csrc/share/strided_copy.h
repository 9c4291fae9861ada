// A dispatch outside of the graph: moves pixels from a buffer with any strides to an image, and
// counts NaN and infinity among them, or from an image to a dense buffer.
#ifndef VKB_STRIDED_COPY_H
#define VKB_STRIDED_COPY_H

#include "execute/bindings.h"
#include "execute/descriptors.h"
#include "vulkan/memory.h"

enum vkb_strided_copy_kind {
    VKB_STRIDED_COPY_TO_IMAGE,
    VKB_STRIDED_COPY_FROM_IMAGE,
    VKB_STRIDED_COPY_TO_LAYERS,
    VKB_STRIDED_COPY_FROM_LAYERS,
    VKB_FETCH_TEXELS,  // of 64 x 1 texels, as floats
    VKB_STRIDED_COPY_COUNT,
};

// Created at the first use of each kind; destroying a zeroed or half-created one is safe.
struct vkb_strided_copies {
    struct vkb_strided_copy_pipeline {
        struct vkb_layouts layouts;
        VkPipeline handle;
    } pipelines[VKB_STRIDED_COPY_COUNT];
};

bool vkb_strided_copy_create(const struct vkb_device *device, VkPipelineCache cache,
                             enum vkb_strided_copy_kind kind, struct vkb_strided_copies *copies,
                             struct vkb_error *error);
void vkb_strided_copy_destroy(const struct vkb_device *device, struct vkb_strided_copies *copies);

// What becomes of NaN and infinity in a copy to an image.
enum vkb_non_finite_use {
    VKB_NON_FINITE_COUNTED,
    VKB_NON_FINITE_NAN_IS_ZERO,
    VKB_NON_FINITE_IS_ZERO,
};

// The push constants of strided_copy.glsl: the layout of the buffer, strides in bytes. A copy from
// an image is dense.
struct vkb_strided_copy_layout {
    int32_t offset, row_stride, pixel_stride, channel_stride;
    uint32_t width, height, channels;
    uint32_t size, stores;
    int32_t layer_stride;  // a multiple of 16 where a copy is from images
    uint32_t aligned;      // pixels of four channels that begin with words, without gaps
    uint32_t non_finite;   // enum vkb_non_finite_use
};

// By its kind, `image` stands in place of `from` or `to`.
struct vkb_strided_copy_work {
    enum vkb_strided_copy_kind kind;
    struct vkb_strided_copy_layout layout;
    VkDescriptorBufferInfo from, to, counts;
    VkDescriptorImageInfo image;
    uint32_t layers;  // 0: it is one image
};

// Bytes from the counts of one image to those of the next.
enum { VKB_COUNTS_SIZE = 256 };

bool vkb_strided_copy_record(const struct vkb_device *device,
                             const struct vkb_strided_copies *copies, VkCommandBuffer commands,
                             struct vkb_descriptors *descriptors,
                             const struct vkb_strided_copy_work *work, struct vkb_error *error);

#endif
