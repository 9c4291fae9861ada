#include "vulkan/image.h"

// Preinitialized: the content that the host writes before the device's first access is kept.
// Images in memory that is imported cannot be that.
static VkImageLayout initial_layout(bool mapped, bool hosted)
{
    return mapped && !hosted ? VK_IMAGE_LAYOUT_PREINITIALIZED : VK_IMAGE_LAYOUT_UNDEFINED;
}

static VkFormat format_of(const struct vkb_image_spec *spec)
{
    return spec->other ? spec->other : vkb_formats[spec->format].vk;
}

// The types of views without layers have the same values.
static VkImageType image_type(const struct vkb_image_spec *spec)
{
    return spec->dimensions ? (VkImageType)(spec->dimensions - 1) : VK_IMAGE_TYPE_2D;
}

static bool create_handle(const struct vkb_device *device, const struct vkb_image_spec *spec,
                          struct vkb_image *image, struct vkb_error *error)
{
    const VkExternalMemoryImageCreateInfo external = {
        .sType = VK_STRUCTURE_TYPE_EXTERNAL_MEMORY_IMAGE_CREATE_INFO,
        .handleTypes = VKB_HOST_ALLOCATION,
    };

    return VK(
        error,
        device->vk.vkCreateImage(
            device->handle,
            &(VkImageCreateInfo){
                .sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
                .pNext = image->hosted ? &external : NULL,
                .flags =
                    image->layers == 6 && !spec->array ? VK_IMAGE_CREATE_CUBE_COMPATIBLE_BIT : 0,
                .imageType = image_type(spec),
                .format = format_of(spec),
                .extent = {spec->width, spec->height, image->depth},
                .mipLevels = image->levels,
                .arrayLayers = image->layers,
                .samples = VK_SAMPLE_COUNT_1_BIT,
                .tiling = spec->mapped ? VK_IMAGE_TILING_LINEAR : VK_IMAGE_TILING_OPTIMAL,
                .usage = spec->usage,
                .initialLayout = initial_layout(spec->mapped, image->hosted),
            },
            NULL, &image->handle));
}

// Whether such an image can be in memory that is imported. It is in large pages, which drivers have
// not for what they share with other processes (Mesa 25).
static bool can_be_hosted(const struct vkb_device *device, const struct vkb_image_spec *spec)
{
    VkExternalImageFormatProperties external = {
        .sType = VK_STRUCTURE_TYPE_EXTERNAL_IMAGE_FORMAT_PROPERTIES,
    };
    VkImageFormatProperties2 properties = {
        .sType = VK_STRUCTURE_TYPE_IMAGE_FORMAT_PROPERTIES_2,
        .pNext = &external,
    };
    const VkPhysicalDeviceExternalImageFormatInfo type = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_EXTERNAL_IMAGE_FORMAT_INFO,
        .handleType = VKB_HOST_ALLOCATION,
    };
    const VkPhysicalDeviceImageFormatInfo2 info = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_IMAGE_FORMAT_INFO_2,
        .pNext = &type,
        .format = format_of(spec),
        .type = image_type(spec),
        .tiling = VK_IMAGE_TILING_LINEAR,
        .usage = spec->usage,
    };
    const VkExternalMemoryProperties *memory = &external.externalMemoryProperties;

    return spec->mapped && spec->hosted && device->import_alignment
        && (size_t)spec->width * spec->height * vkb_pixel_size(spec->format) >= VKB_LARGE_BYTES
        && VK_RESULT(device->instance->vk.vkGetPhysicalDeviceImageFormatProperties2(
               device->adapter.physical, &info, &properties))
               == VK_SUCCESS
        && memory->externalMemoryFeatures & VK_EXTERNAL_MEMORY_FEATURE_IMPORTABLE_BIT
        && !(memory->externalMemoryFeatures & VK_EXTERNAL_MEMORY_FEATURE_DEDICATED_ONLY_BIT);
}

static VkImageSubresourceRange range_of_image(const struct vkb_image *image)
{
    return (VkImageSubresourceRange){
        .aspectMask = vkb_formats[image->format].aspect,
        .levelCount = image->levels,
        .layerCount = image->layers,
    };
}

static bool create_view(const struct vkb_device *device, VkImageViewType type, VkFormat format,
                        struct vkb_image *image, struct vkb_error *error)
{
    return VK(error,
              device->vk.vkCreateImageView(device->handle,
                                           &(VkImageViewCreateInfo){
                                               .sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO,
                                               .image = image->handle,
                                               .viewType = type,
                                               .format = format,
                                               .subresourceRange = range_of_image(image),
                                           },
                                           NULL, &image->view));
}

static bool create_linear_texels(const struct vkb_device *device, struct vkb_image *image,
                                 VkDeviceSize offset, VkDeviceSize size, struct vkb_error *error)
{
    return VK(error,
              device->vk.vkCreateBufferView(device->handle,
                                            &(VkBufferViewCreateInfo){
                                                .sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO,
                                                .buffer = image->buffer,
                                                .format = VKB_WORD_FORMAT,
                                                .offset = offset,
                                                .range = size,
                                            },
                                            NULL, &image->linear_texels));
}

// The bytes of the image's buffer. Mesa 22.3's lavapipe compiles a shader once more for buffers
// whose size is a power of two, or has zeros in the second byte, which it takes for the last level
// of an image. What is compiled once more it does not find in its cache on disk in the next
// process.
static VkDeviceSize buffer_size(const struct vkb_image *image)
{
    const VkDeviceSize size = image->row_pitch * image->height;
    return (size & (size - 1)) == 0 || (size >> 8 & 0xff) == 0 ? size + 256 + VKB_WORD_SIZE : size;
}

bool vkb_image_linear_texels(const struct vkb_device *device, struct vkb_image *image,
                             struct vkb_error *error)
{
    return image->linear_texels
        || create_linear_texels(device, image, 0, buffer_size(image), error);
}

bool vkb_image_borrow(const struct vkb_device *device, size_t row_size, struct vkb_image *image)
{
    const size_t size = image->row_pitch * (image->height - 1) + row_size;
    struct vkb_buffer buffer;
    struct vkb_error ignored;
    VkDeviceSize offset;

    if (!vkb_buffer_import(device, vkb_device_import_usage(device), image->mapped, size, &buffer,
                           &offset))
        return false;
    image->memory = buffer.memory;
    image->buffer = buffer.handle;
    image->access = VKB_ACCESS_DISPATCH_LOADED;
    if (offset % device->limits.minTexelBufferOffsetAlignment == 0
        && create_linear_texels(device, image, offset, size, &ignored))
        return true;
    vkb_image_destroy(device, image);
    return false;
}

size_t vkb_image_row_pitch(enum vkb_format format, uint32_t width)
{
    // No driver aligns rows to more than that.
    return ((size_t)width * vkb_pixel_size(format) + 255) / 256 * 256;
}

bool vkb_image_fits_linear_texels(const struct vkb_device *device, enum vkb_format format,
                                  uint32_t width, uint32_t height)
{
    const uint64_t words = vkb_image_row_pitch(format, width) / VKB_WORD_SIZE;

    // With what buffer_size() adds.
    return words * height + 17 <= device->limits.maxTexelBufferElements;
}

// The image's memory as a buffer.
static bool create_image_buffer(const struct vkb_device *device, struct vkb_image *image,
                                VkMemoryRequirements *requirements, struct vkb_error *error)
{
    VkSubresourceLayout layout;
    VkMemoryRequirements own;

    device->vk.vkGetImageSubresourceLayout(
        device->handle, image->handle,
        &(VkImageSubresource){.aspectMask = vkb_formats[image->format].aspect}, &layout);
    image->row_pitch = (size_t)layout.rowPitch;
    // What variants store at once.
    if (layout.offset || image->row_pitch % VKB_STORE_SIZE)
        return vkb_fail(error, VKB_ERROR_GENERAL,
                        "rows of images begin at no multiples of %d bytes", VKB_STORE_SIZE);
    if (!vkb_buffer_create_handle(
            device,
            VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT
                | VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
            buffer_size(image), image->hosted ? VKB_HOST_ALLOCATION : 0, &image->buffer, error))
        return false;
    device->vk.vkGetBufferMemoryRequirements(device->handle, image->buffer, &own);
    requirements->memoryTypeBits &= own.memoryTypeBits;
    if (requirements->size < own.size)
        requirements->size = own.size;
    return true;
}

static bool map_image(const struct vkb_device *device, struct vkb_image *image,
                      struct vkb_error *error)
{
    if (!VK(error, device->vk.vkBindBufferMemory(device->handle, image->buffer, image->memory, 0))
        || !VK(error, device->vk.vkMapMemory(device->handle, image->memory, 0, VK_WHOLE_SIZE, 0,
                                             &image->mapped)))
        return false;
    vkb_advise_large(image->mapped, image->row_pitch * image->height);
    return true;
}

// Images with none of these have no view.
#define VIEWED \
    (VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT \
     | VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT)

bool vkb_image_create(const struct vkb_device *device, const struct vkb_image_spec *spec,
                      struct vkb_image *image, struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;
    const VkImageViewType type = spec->array       ? VK_IMAGE_VIEW_TYPE_2D_ARRAY
                               : spec->layers == 6 ? VK_IMAGE_VIEW_TYPE_CUBE
                                                   : (VkImageViewType)image_type(spec);
    VkMemoryRequirements requirements;
    struct vkb_spare made = {0};

    *image = (struct vkb_image){
        .format = spec->format,
        .width = spec->width,
        .height = spec->height,
        .depth = spec->dimensions ? spec->depth : 1,
        .layers = spec->layers ? spec->layers : 1,
        .levels = spec->levels ? spec->levels : 1,
        .usage = spec->usage,
        .array = spec->array,
        .hosted = can_be_hosted(device, spec),
        .channels = vkb_formats[spec->format].channels,
    };
    if (!create_handle(device, spec, image, error))
        return false;
    vk->vkGetImageMemoryRequirements(device->handle, image->handle, &requirements);
    const bool allocated =
        (!spec->mapped || create_image_buffer(device, image, &requirements, error))
        && vkb_memory_allocate(device, spec->mapped ? VKB_MEMORY_SHARED : VKB_MEMORY_DEVICE,
                               &requirements, NULL, image->hosted, spec->spares, &made, error);
    image->memory = made.memory;
    image->host = made.host;
    image->memory_size = made.size;
    image->memory_type = made.type;
    if (!allocated
        || !VK(error, vk->vkBindImageMemory(device->handle, image->handle, image->memory, 0))
        || (spec->mapped && !map_image(device, image, error))
        || ((spec->usage & VIEWED) && !create_view(device, type, format_of(spec), image, error))) {
        vkb_image_destroy(device, image);
        return false;
    }
    return true;
}

void vkb_image_destroy(const struct vkb_device *device, struct vkb_image *image)
{
    device->vk.vkDestroyBufferView(device->handle, image->linear_texels, NULL);
    device->vk.vkDestroyBuffer(device->handle, image->buffer, NULL);
    device->vk.vkDestroyImageView(device->handle, image->view, NULL);
    device->vk.vkDestroyImage(device->handle, image->handle, NULL);
    vkb_memory_free(device, image->memory, image->host);
    *image = (struct vkb_image){0};
}

void vkb_image_spare(const struct vkb_device *device, struct vkb_image *image, uint64_t used,
                     struct vkb_spares *spares)
{
    const struct vkb_spare spare = {
        .memory = image->memory,
        .host = image->host,
        .size = image->memory_size,
        .type = image->memory_type,
        .used = used,
    };

    if (image->memory && vkb_spares_add(spares, &spare)) {
        if (image->mapped)
            device->vk.vkUnmapMemory(device->handle, image->memory);
        image->memory = VK_NULL_HANDLE;
        image->host = NULL;
    }
    vkb_image_destroy(device, image);
}

VkImageLayout vkb_image_layout(const struct vkb_image *image, enum vkb_access access)
{
    return !image->mapped            ? vkb_access_layout(access)
         : access == VKB_ACCESS_NONE ? initial_layout(true, image->hosted)
                                     : VK_IMAGE_LAYOUT_GENERAL;
}

void vkb_image_transition(const struct vkb_device *device, VkCommandBuffer commands,
                          struct vkb_image *image, enum vkb_access access)
{
    const VkImageMemoryBarrier barrier = {
        .oldLayout = vkb_image_layout(image, image->access),
        .newLayout = vkb_image_layout(image, access),
        .image = image->handle,
        .subresourceRange = range_of_image(image),
    };

    // A mapped image is also accessed as a buffer, and only a memory barrier covers these writes.
    // It needs an image barrier only if its layout changes.
    vkb_barrier_record(device, commands,
                       !image->mapped || barrier.oldLayout != barrier.newLayout ? &barrier : NULL,
                       image->mapped, image->access, access);
    image->access = access;
}

void vkb_image_fill(const struct vkb_device *device, VkCommandBuffer commands,
                    struct vkb_image *image, VkBuffer from, VkDeviceSize offset)
{
    vkb_image_transition(device, commands, image, VKB_ACCESS_COPY_TARGET);
    device->vk.vkCmdCopyBufferToImage(
        commands, from, image->handle, vkb_image_layout(image, VKB_ACCESS_COPY_TARGET), 1,
        &(VkBufferImageCopy){
            .bufferOffset = offset,
            .imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1},
            .imageExtent = {image->width, image->height, image->depth},
        });
}
