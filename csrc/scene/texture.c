#include "scene/texture.h"

bool vkb_texture_load(const struct vkb_device *device, VkCommandBuffer commands,
                      struct vkb_staging *staging, const struct vkb_texture_data *data,
                      struct vkb_texture *texture, struct vkb_error *error)
{
    return VK(error, device->vk.vkCreateSampler(device->handle,
                                                &(VkSamplerCreateInfo){
                                                    .sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO,
                                                    .magFilter = data->mag_filter,
                                                    .minFilter = data->min_filter,
                                                    .mipmapMode = data->mipmap_filter,
                                                    .addressModeU = data->address_modes[0],
                                                    .addressModeV = data->address_modes[1],
                                                    .addressModeW = VK_SAMPLER_ADDRESS_MODE_REPEAT,
                                                    .maxLod = VK_LOD_CLAMP_NONE,
                                                },
                                                NULL, &texture->sampler))
        && vkb_staging_load_picture(device, commands, staging, "texture", &data->picture,
                                    &texture->image, error);
}

void vkb_texture_destroy(const struct vkb_device *device, struct vkb_texture *texture)
{
    device->vk.vkDestroySampler(device->handle, texture->sampler, NULL);
    vkb_image_destroy(device, &texture->image);
    *texture = (struct vkb_texture){0};
}
