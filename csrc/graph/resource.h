// Textures and buffers that a method brings along. Their owner keeps them as long as there are rows
// that refer to them.
#ifndef VKB_RESOURCE_H
#define VKB_RESOURCE_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

struct vkb_error;

enum vkb_resource_kind {
    VKB_RESOURCE_TEXTURE,  // read through its own sampler
    VKB_RESOURCE_IMAGE,    // a storage image, which passes read and write
    VKB_RESOURCE_UNIFORM,
    VKB_RESOURCE_STORAGE,  // a storage buffer, which passes read and write
    VKB_RESOURCE_KINDS
};

// What the state of resources belongs to: a sequence of frames, or one frame. The host has it, and
// so have caches, which thus learn that nobody needs the state any more.
struct vkb_owner {
    atomic_uint holders;
    atomic_bool gone;
};

// Destroying it needs one call of vkb_owner_leave, by the host from any thread, and one of
// vkb_owner_release for each of vkb_owner_hold. All take NULL but vkb_owner_leave.
struct vkb_owner *vkb_owner_create(struct vkb_error *error);
struct vkb_owner *vkb_owner_hold(struct vkb_owner *owner);
void vkb_owner_release(struct vkb_owner *owner);
void vkb_owner_leave(struct vkb_owner *owner);

struct vkb_resource {
    uint64_t serial, size;  // the serial is no other resource's; the size is in bytes
    uint32_t kind;          // enum vkb_resource_kind
    // Of a texture or an image; the rest is 0 for buffers.
    uint32_t format;      // VkFormat
    uint32_t dimensions;  // 1 to 3; sides beyond are 1
    uint32_t width, height, depth;
    uint32_t linear;  // the filter
    uint32_t border;  // VkSamplerAddressMode
    // Python packs what is before here, as "2Q8I".
    const void *data;         // NULL: zeros
    struct vkb_owner *owner;  // of the state; NULL: no pass changes the resource
};

static inline bool vkb_resource_is_image(const struct vkb_resource *resource)
{
    return resource->kind == VKB_RESOURCE_TEXTURE || resource->kind == VKB_RESOURCE_IMAGE;
}

#endif
