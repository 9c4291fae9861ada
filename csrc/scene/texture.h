// Textures of a scene's meshes: images, each with its own sampler.
#ifndef VKB_TEXTURE_H
#define VKB_TEXTURE_H

#include "vulkan/staging.h"

struct vkb_texture_data {
    struct vkb_picture_data picture;
    VkSamplerAddressMode address_modes[2];  // horizontal, vertical
    VkFilter mag_filter, min_filter;
    VkSamplerMipmapMode mipmap_filter;
};

struct vkb_texture {
    struct vkb_image image;
    VkSampler sampler;
};

// Destroying a zeroed or half-loaded texture is safe.
bool vkb_texture_load(const struct vkb_device *device, VkCommandBuffer commands,
                      struct vkb_staging *staging, const struct vkb_texture_data *data,
                      struct vkb_texture *texture, struct vkb_error *error);
void vkb_texture_destroy(const struct vkb_device *device, struct vkb_texture *texture);

#endif
