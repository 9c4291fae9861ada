// Textures and buffers that a method brings along. Their owner keeps them as long as there are rows
// that refer to them.
#ifndef VKB_RESOURCE_H
#define VKB_RESOURCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum vkb_resource_kind {
    VKB_RESOURCE_TEXTURE,  // read through its own sampler
    VKB_RESOURCE_IMAGE,    // a storage image, which passes read and write
    VKB_RESOURCE_UNIFORM,
    VKB_RESOURCE_STORAGE,  // a storage buffer, which passes read and write
    VKB_RESOURCE_KINDS
};

struct vkb_resource {
    uint64_t serial;  // no other resource's
    enum vkb_resource_kind kind;
    // Of a texture or an image; the rest is 0 for buffers.
    uint32_t format;      // VkFormat
    uint32_t dimensions;  // 1 to 3; sides beyond are 1
    uint32_t width, height, depth;
    bool linear;       // the filter
    uint32_t border;   // VkSamplerAddressMode
    const void *data;  // NULL: zeros
    size_t size;
};

static inline bool vkb_resource_is_image(const struct vkb_resource *resource)
{
    return resource->kind == VKB_RESOURCE_TEXTURE || resource->kind == VKB_RESOURCE_IMAGE;
}

#endif
