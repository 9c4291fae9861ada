#include "scene.h"

#include <math.h>
#include <string.h>

const VkVertexInputAttributeDescription vkb_vertex_attributes[VKB_VERTEX_ATTRIBUTES] = {
    {0, 0, VK_FORMAT_R32G32B32_SFLOAT, offsetof(struct vkb_vertex, position)},
    {1, 0, VK_FORMAT_R32G32B32_SFLOAT, offsetof(struct vkb_vertex, normal)},
    {2, 0, VK_FORMAT_R32G32B32_SFLOAT, offsetof(struct vkb_vertex, colour)},
    {3, 0, VK_FORMAT_R32G32B32_SFLOAT, offsetof(struct vkb_vertex, emission)},
};

// Where the pieces of a scene lie in the one staging buffer that brings them to the device.
struct staging {
    struct vkb_buffer buffer;
    VkDeviceSize used;
};

static size_t vertex_bytes(const struct vkb_mesh_data *data)
{
    return data->vertex_count * sizeof(struct vkb_vertex);
}

static size_t index_bytes(const struct vkb_mesh_data *data)
{
    return data->index_count * sizeof *data->indices;
}

static uint32_t level_size(const struct vkb_sky_data *data, uint32_t level)
{
    uint32_t size = data->size >> level;
    return size ? size : 1;
}

static size_t level_bytes(const struct vkb_sky_data *data, uint32_t level)
{
    size_t size = level_size(data, level);
    return 6 * size * size * vkb_pixel_size(data->format);
}

// Offsets of image copies must be multiples of the pixel size, 16 at the most.
static VkDeviceSize align16(VkDeviceSize size)
{
    return (size + 15) & ~(VkDeviceSize)15;
}

static VkDeviceSize staging_bytes(const struct vkb_scene_data *data)
{
    VkDeviceSize size = align16(vertex_bytes(&data->body)) + align16(index_bytes(&data->body))
                      + align16(vertex_bytes(&data->glow)) + align16(index_bytes(&data->glow));

    for (uint32_t level = 0; level < data->sky.level_count; ++level)
        size += align16(level_bytes(&data->sky, level));
    return size;
}

static VkDeviceSize stage(struct staging *staging, const void *data, size_t size)
{
    VkDeviceSize offset = staging->used;

    memcpy((char *)staging->buffer.mapped + offset, data, size);
    staging->used += align16(size);
    return offset;
}

static VkDeviceSize stage_vertices(struct staging *staging, const struct vkb_mesh_data *data)
{
    static const float none[3];
    const VkDeviceSize offset = staging->used;
    struct vkb_vertex *vertices = (void *)((char *)staging->buffer.mapped + offset);

    for (size_t i = 0; i < data->vertex_count; ++i) {
        memcpy(&vertices[i], data->vertices + VKB_GIVEN_FLOATS * i,
               offsetof(struct vkb_vertex, emission));
        memcpy(vertices[i].emission, data->emission ? data->emission + 3 * i : none, sizeof none);
    }
    staging->used += align16(vertex_bytes(data));
    return offset;
}

// A buffer on the device with what lies in the staging buffer from `offset` on.
static bool load_buffer(const struct vkb_device *device, VkCommandBuffer commands,
                        const struct staging *staging, VkDeviceSize offset, size_t size,
                        VkBufferUsageFlags usage, struct vkb_buffer *buffer,
                        struct vkb_error *error)
{
    if (!vkb_buffer_create(device, VKB_MEMORY_DEVICE, usage | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                           size, buffer, error))
        return false;
    device->vk.vkCmdCopyBuffer(commands, staging->buffer.handle, buffer->handle, 1,
                               &(VkBufferCopy){
                                   .srcOffset = offset,
                                   .size = size,
                               });
    return true;
}

static bool load_mesh(const struct vkb_device *device, VkCommandBuffer commands,
                      struct staging *staging, const struct vkb_mesh_data *data,
                      struct vkb_mesh *mesh, struct vkb_error *error)
{
    mesh->index_count = data->index_count;
    if (data->index_count == 0)
        return true;
    const VkDeviceSize vertices = stage_vertices(staging, data);
    const VkDeviceSize indices = stage(staging, data->indices, index_bytes(data));
    return load_buffer(device, commands, staging, vertices, vertex_bytes(data),
                       VK_BUFFER_USAGE_VERTEX_BUFFER_BIT, &mesh->vertices, error)
        && load_buffer(device, commands, staging, indices, index_bytes(data),
                       VK_BUFFER_USAGE_INDEX_BUFFER_BIT, &mesh->indices, error);
}

static bool load_sky(const struct vkb_device *device, VkCommandBuffer commands,
                     struct staging *staging, const struct vkb_sky_data *data,
                     struct vkb_image *sky, struct vkb_error *error)
{
    if (data->level_count == 0)
        return true;
    if (data->size > device->limits.maxImageDimensionCube)
        return vkb_fail(error, VKB_ERROR_VALUE,
                        "skybox: faces of %u pixels are beyond this adapter's limit of %u",
                        data->size, device->limits.maxImageDimensionCube);
    if (!vkb_image_create(device,
                          &(struct vkb_image_spec){
                              .format = data->format,
                              .width = data->size,
                              .height = data->size,
                              .layers = 6,
                              .levels = data->level_count,
                              .usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT,
                          },
                          sky, error))
        return false;
    vkb_image_transition(device, commands, sky, VKB_ACCESS_COPY_TARGET);
    for (uint32_t level = 0; level < data->level_count; ++level) {
        uint32_t size = level_size(data, level);
        VkBufferImageCopy copy = {
            .bufferOffset = stage(staging, data->levels[level], level_bytes(data, level)),
            .imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, level, 0, 6},
            .imageExtent = {size, size, 1},
        };
        device->vk.vkCmdCopyBufferToImage(commands, staging->buffer.handle, sky->handle,
                                          vkb_access_layout(VKB_ACCESS_COPY_TARGET), 1, &copy);
    }
    vkb_image_transition(device, commands, sky, VKB_ACCESS_SAMPLED);
    return true;
}

static bool check_indices(const struct vkb_mesh_data *data, struct vkb_error *error)
{
    for (uint32_t i = 0; i < data->index_count; ++i)
        if (data->indices[i] >= data->vertex_count)
            return vkb_fail(error, VKB_ERROR_VALUE,
                            "scene: index %u is beyond the mesh's %u vertices", data->indices[i],
                            data->vertex_count);
    return true;
}

bool vkb_scene_load(struct vkb_device *device, struct vkb_commands *commands,
                    const struct vkb_scene_data *data, struct vkb_scene *scene,
                    struct vkb_error *error)
{
    struct staging staging = {0};

    if (scene->serial == data->serial)
        return true;
    if (!check_indices(&data->body, error) || !check_indices(&data->glow, error))
        return false;
    vkb_scene_destroy(device, scene);
    bool done = vkb_buffer_create(device, VKB_MEMORY_UPLOAD, VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                                  staging_bytes(data), &staging.buffer, error)
             && vkb_commands_begin(device, commands, error)
             && load_mesh(device, commands->buffer, &staging, &data->body, &scene->body, error)
             && load_mesh(device, commands->buffer, &staging, &data->glow, &scene->glow, error)
             && load_sky(device, commands->buffer, &staging, &data->sky, &scene->sky, error)
             && vkb_buffer_flush(device, &staging.buffer, error);
    if (done) {
        vkb_barrier_record_upload(device, commands->buffer);
        done = vkb_commands_submit(device, commands, error)
            && vkb_commands_wait(device, commands, error);
    }
    vkb_buffer_destroy(device, &staging.buffer);
    if (done)
        scene->serial = data->serial;
    else
        vkb_scene_destroy(device, scene);
    return done;
}

static void destroy_mesh(const struct vkb_device *device, struct vkb_mesh *mesh)
{
    vkb_buffer_destroy(device, &mesh->vertices);
    vkb_buffer_destroy(device, &mesh->indices);
}

void vkb_scene_destroy(const struct vkb_device *device, struct vkb_scene *scene)
{
    destroy_mesh(device, &scene->body);
    destroy_mesh(device, &scene->glow);
    vkb_image_destroy(device, &scene->sky);
    *scene = (struct vkb_scene){0};
}

// Matrices are column by column: m[column][row].
typedef double matrix[4][4];

static void set_identity(matrix m)
{
    memset(m, 0, sizeof(matrix));
    for (int i = 0; i < 4; ++i)
        m[i][i] = 1.0;
}

// m = m * translation
static void translate(matrix m, double x, double y, double z)
{
    for (int row = 0; row < 4; ++row)
        m[3][row] += m[0][row] * x + m[1][row] * y + m[2][row] * z;
}

// m = m * rotation by `angle` radians around axis 0, 1 or 2
static void rotate(matrix m, int axis, double angle)
{
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    const double c = cos(angle), s = sin(angle);

    for (int row = 0; row < 4; ++row) {
        double at_a = m[a][row], at_b = m[b][row];
        m[a][row] = c * at_a + s * at_b;
        m[b][row] = c * at_b - s * at_a;
    }
}

static void store(matrix m, float out[4][4])
{
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row)
            out[column][row] = (float)m[column][row];
}

void vkb_scene_matrices(const struct vkb_camera *camera, double time, double aspect,
                        struct vkb_mesh_params *params)
{
    const double pi = 3.14159265358979323846;
    const double degree = pi / 180.0, turn = 2.0 * pi;
    const double focal = 1.0 / tan(camera->fov * degree / 2.0);
    const double near = camera->near, far = camera->far;
    matrix m;

    // Perspective with y down and depth 0..1 (the forward system's camera).
    memset(m, 0, sizeof m);
    m[0][0] = focal / aspect;
    m[1][1] = focal;
    m[2][2] = far / (near - far);
    m[2][3] = -1.0;
    m[3][2] = near * far / (near - far);
    store(m, params->projection);

    set_identity(m);
    translate(m, camera->position[0], camera->position[1], camera->position[2]);
    for (int axis = 0; axis < 3; ++axis)
        rotate(m, axis, camera->rotation[axis] * degree);
    store(m, params->view);

    set_identity(m);
    translate(m, 0.25 * sin(turn * time), -1.0, 0.25 * cos(turn * time));
    rotate(m, 0, -0.15 * sin(turn * time));
    rotate(m, 1, turn * time);
    store(m, params->model);
}
