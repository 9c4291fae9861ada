#include "scene/scene.h"

#include <string.h>

const VkVertexInputAttributeDescription vkb_vertex_attributes[VKB_TEXTURED_ATTRIBUTES] = {
    {0, 0, VK_FORMAT_R32G32B32A32_SFLOAT, offsetof(struct vkb_vertex, position)},
    {1, 0, VK_FORMAT_R32G32B32A32_SFLOAT, offsetof(struct vkb_vertex, normal)},
    {2, 0, VK_FORMAT_R32G32B32A32_SFLOAT, offsetof(struct vkb_vertex, colour)},
    {3, 1, VK_FORMAT_R32G32B32A32_SFLOAT, 0},
};

const VkVertexInputBindingDescription vkb_vertex_bindings[VKB_VERTEX_BINDINGS] = {
    {0, sizeof(struct vkb_vertex), VK_VERTEX_INPUT_RATE_VERTEX},
    {1, VKB_TEXCOORDS * sizeof(float), VK_VERTEX_INPUT_RATE_VERTEX},
};

static size_t vertex_bytes(const struct vkb_mesh_data *data)
{
    return data->vertex_count * sizeof(struct vkb_vertex);
}

static size_t texcoord_bytes(const struct vkb_mesh_data *data)
{
    return data->surface_count ? data->vertex_count * VKB_TEXCOORDS * sizeof *data->texcoords : 0;
}

static size_t index_bytes(const struct vkb_mesh_data *data)
{
    return data->index_count * sizeof *data->indices;
}

static VkDeviceSize mesh_size(const struct vkb_mesh_data *data)
{
    return vkb_staging_size(vertex_bytes(data)) + vkb_staging_size(texcoord_bytes(data))
         + vkb_staging_size(index_bytes(data));
}

static VkDeviceSize scene_size(const struct vkb_scene_data *data)
{
    VkDeviceSize size =
        mesh_size(&data->body) + mesh_size(&data->glow) + vkb_staging_picture_size(&data->sky);

    for (uint32_t i = 0; i < data->texture_count; ++i)
        size += vkb_staging_picture_size(&data->textures[i].picture);
    return size;
}

static VkDeviceSize stage_bytes(struct vkb_staging *staging, const void *data, size_t size)
{
    VkDeviceSize offset;

    memcpy(vkb_stage(staging, size, &offset), data, size);
    return offset;
}

static bool load_surfaces(const struct vkb_device *device, VkCommandBuffer commands,
                          struct vkb_staging *staging, const struct vkb_mesh_data *data,
                          struct vkb_mesh *mesh, struct vkb_error *error)
{
    if (data->surface_count == 0)
        return true;
    mesh->surfaces = vkb_alloc(error, data->surface_count, sizeof *mesh->surfaces);
    if (!mesh->surfaces)
        return false;
    memcpy(mesh->surfaces, data->surfaces, data->surface_count * sizeof *mesh->surfaces);
    mesh->surface_count = data->surface_count;
    for (uint32_t i = 0; i < mesh->surface_count; ++i)
        mesh->plain_count -= mesh->surfaces[i].index_count;
    const VkDeviceSize texcoords = stage_bytes(staging, data->texcoords, texcoord_bytes(data));
    return vkb_staging_load_buffer(device, commands, staging, texcoords, texcoord_bytes(data),
                                   VK_BUFFER_USAGE_VERTEX_BUFFER_BIT, &mesh->texcoords, error);
}

static bool load_mesh(const struct vkb_device *device, VkCommandBuffer commands,
                      struct vkb_staging *staging, const struct vkb_mesh_data *data,
                      struct vkb_mesh *mesh, struct vkb_error *error)
{
    mesh->plain_count = data->index_count;
    if (data->index_count == 0)
        return true;
    const VkDeviceSize vertices = stage_bytes(staging, data->vertices, vertex_bytes(data));
    const VkDeviceSize indices = stage_bytes(staging, data->indices, index_bytes(data));
    return vkb_staging_load_buffer(device, commands, staging, vertices, vertex_bytes(data),
                                   VK_BUFFER_USAGE_VERTEX_BUFFER_BIT, &mesh->vertices, error)
        && vkb_staging_load_buffer(device, commands, staging, indices, index_bytes(data),
                                   VK_BUFFER_USAGE_INDEX_BUFFER_BIT, &mesh->indices, error)
        && load_surfaces(device, commands, staging, data, mesh, error);
}

static bool load_texture(const struct vkb_device *device, VkCommandBuffer commands,
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

static bool load_textures(const struct vkb_device *device, VkCommandBuffer commands,
                          struct vkb_staging *staging, const struct vkb_scene_data *data,
                          struct vkb_scene *scene, struct vkb_error *error)
{
    if (data->texture_count == 0)
        return true;
    scene->textures = vkb_alloc(error, data->texture_count, sizeof *scene->textures);
    if (!scene->textures)
        return false;
    scene->texture_count = data->texture_count;
    for (uint32_t i = 0; i < data->texture_count; ++i)
        if (!load_texture(device, commands, staging, &data->textures[i], &scene->textures[i],
                          error))
            return false;
    return true;
}

bool vkb_scene_begin(const struct vkb_device *device, struct vkb_commands *commands,
                     const struct vkb_scene_data *data, struct vkb_scene *scene,
                     struct vkb_error *error)
{
    struct vkb_staging *staging = &scene->staging;

    vkb_scene_destroy(device, scene);
    bool done = vkb_buffer_create(device, VKB_MEMORY_UPLOAD, VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                                  scene_size(data), &staging->buffer, error)
             && vkb_commands_begin(device, commands, error)
             && load_mesh(device, commands->buffer, staging, &data->body, &scene->body, error)
             && load_mesh(device, commands->buffer, staging, &data->glow, &scene->glow, error)
             && vkb_staging_load_picture(device, commands->buffer, staging, "skybox", &data->sky,
                                         &scene->sky, error)
             && load_textures(device, commands->buffer, staging, data, scene, error)
             && vkb_buffer_flush(device, &staging->buffer, error);
    if (done)
        vkb_barrier_record(device, commands->buffer, NULL, true, VKB_ACCESS_COPY_TARGET,
                           VKB_ACCESS_VERTICES);
    else
        vkb_scene_destroy(device, scene);
    return done;
}

void vkb_scene_end(const struct vkb_device *device, const struct vkb_scene_data *data,
                   struct vkb_scene *scene)
{
    vkb_buffer_destroy(device, &scene->staging.buffer);
    scene->staging.used = 0;
    scene->serial = data->serial;
}

static void destroy_mesh(const struct vkb_device *device, struct vkb_mesh *mesh)
{
    vkb_buffer_destroy(device, &mesh->vertices);
    vkb_buffer_destroy(device, &mesh->texcoords);
    vkb_buffer_destroy(device, &mesh->indices);
    vkb_free(mesh->surfaces);
}

static void destroy_texture(const struct vkb_device *device, struct vkb_texture *texture)
{
    device->vk.vkDestroySampler(device->handle, texture->sampler, NULL);
    vkb_image_destroy(device, &texture->image);
}

void vkb_scene_destroy(const struct vkb_device *device, struct vkb_scene *scene)
{
    vkb_buffer_destroy(device, &scene->staging.buffer);
    destroy_mesh(device, &scene->body);
    destroy_mesh(device, &scene->glow);
    vkb_image_destroy(device, &scene->sky);
    for (uint32_t i = 0; i < scene->texture_count; ++i)
        destroy_texture(device, &scene->textures[i]);
    vkb_free(scene->textures);
    *scene = (struct vkb_scene){0};
}
