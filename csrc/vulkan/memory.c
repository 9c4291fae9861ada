// madvise and its flags are no part of C11.
#define _DEFAULT_SOURCE
#include "vulkan/memory.h"

#include "vulkan/labels.h"

#ifdef __linux__
#include <sys/mman.h>
#endif

enum { LARGE_PAGE = 2 << 20, SMALL_PAGE = 4096 };

static size_t round_up(size_t size, size_t step)
{
    return (size + step - 1) / step * step;
}

// Advises the system to use large pages for memory that has not been written yet.
static void advise_large(void *memory, size_t size)
{
#ifdef MADV_HUGEPAGE
    // The range must start at a page. Where the system has no large ones, nothing is lost.
    const size_t skipped = (size_t)(-(uintptr_t)memory % SMALL_PAGE);
    if (size >= VKB_LARGE_BYTES)
        (void)madvise((char *)memory + skipped, size - skipped, MADV_HUGEPAGE);
#else
    (void)memory, (void)size;
#endif
}

// The smallest pages that the device can import.
static size_t page_of(const struct vkb_device *device)
{
    return device && device->import_alignment > SMALL_PAGE ? (size_t)device->import_alignment
                                                           : SMALL_PAGE;
}

size_t vkb_size_of_pages(const struct vkb_device *device, size_t size)
{
    return round_up(size, page_of(device));
}

void *vkb_alloc_pages(const struct vkb_device *device, size_t size, void **start,
                      struct vkb_error *error)
{
    const size_t page = page_of(device);
    const size_t align = size >= VKB_LARGE_BYTES && LARGE_PAGE > page ? LARGE_PAGE : page;

    if (size > SIZE_MAX - align - page)
        size = SIZE_MAX - align - page;
    if (!(*start = vkb_alloc(error, 1, size + align + page)))
        return NULL;
    void *memory = (void *)round_up((uintptr_t)*start, align);
    advise_large(memory, vkb_size_of_pages(device, size));
    return memory;
}

// The required flags of a memory type, and the preferred ones.
static const struct memory_wish {
    VkMemoryPropertyFlags needed, wanted;
} wishes[] = {
    [VKB_MEMORY_DEVICE] = {0, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT},
    [VKB_MEMORY_UPLOAD] = {VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT,
                           VK_MEMORY_PROPERTY_HOST_COHERENT_BIT},
    // Reading uncached memory is a hundred times slower.
    [VKB_MEMORY_READBACK] = {VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT,
                             VK_MEMORY_PROPERTY_HOST_CACHED_BIT},
    [VKB_MEMORY_SHARED] = {VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT
                               | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT,
                           VK_MEMORY_PROPERTY_HOST_CACHED_BIT},
};

// The first suitable type with the preferred flags, else the first suitable type.
static uint32_t find_memory_type(const struct vkb_device *device, enum vkb_memory_kind kind,
                                 uint32_t allowed)
{
    const struct memory_wish *wish = &wishes[kind];
    uint32_t fallback = UINT32_MAX;

    for (uint32_t i = 0; i < device->memory.memoryTypeCount; ++i) {
        VkMemoryPropertyFlags flags = device->memory.memoryTypes[i].propertyFlags;
        if (!(allowed >> i & 1) || (flags & wish->needed) != wish->needed)
            continue;
        if ((flags & wish->wanted) == wish->wanted)
            return i;
        if (fallback == UINT32_MAX)
            fallback = i;
    }
    return fallback;
}

// More allocations than the adapter allows are invalid, not an error that it reports.
static bool allocate(const struct vkb_device *device, const VkMemoryAllocateInfo *info,
                     VkDeviceMemory *memory, struct vkb_error *error)
{
    const uint32_t limit = device->limits.maxMemoryAllocationCount;

    if (atomic_fetch_add(device->allocations, 1) >= limit)
        vkb_fail(error, VKB_ERROR_OUT_OF_MEMORY,
                 "memory is short: the adapter %s allows %u allocations "
                 "(maxMemoryAllocationCount); delete uploaded images and frames on the device, or "
                 "close renderers",
                 device->adapter.name, limit);
    else if (VK(error, device->vk.vkAllocateMemory(device->handle, info, NULL, memory)))
        return true;
    atomic_fetch_sub(device->allocations, 1);
    return false;
}

#define HOST_ALLOCATION VK_EXTERNAL_MEMORY_HANDLE_TYPE_HOST_ALLOCATION_BIT_EXT

// The memory types that the host memory can be imported as; 0: none.
static uint32_t import_types(const struct vkb_device *device, void *memory)
{
    VkMemoryHostPointerPropertiesEXT properties = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_HOST_POINTER_PROPERTIES_EXT,
    };

    return VK_RESULT(device->vk.vkGetMemoryHostPointerPropertiesEXT(device->handle, HOST_ALLOCATION,
                                                                    memory, &properties))
                == VK_SUCCESS
             ? properties.memoryTypeBits
             : 0;
}

static bool import_pages(const struct vkb_device *device, void *memory, VkDeviceSize size,
                         uint32_t type, VkDeviceMemory *imported, struct vkb_error *error)
{
    return allocate(device,
                    &(VkMemoryAllocateInfo){
                        .sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
                        .pNext =
                            &(VkImportMemoryHostPointerInfoEXT){
                                .sType = VK_STRUCTURE_TYPE_IMPORT_MEMORY_HOST_POINTER_INFO_EXT,
                                .handleType = HOST_ALLOCATION,
                                .pHostPointer = memory,
                            },
                        .allocationSize = size,
                        .memoryTypeIndex = type,
                    },
                    imported, error);
}

// New memory of the host's, in large pages. False without an error if there is none or the device
// cannot import it.
static bool allocate_hosted(const struct vkb_device *device, struct vkb_spare *made)
{
    const size_t size = vkb_size_of_pages(device, (size_t)made->size);
    struct vkb_error ignored;
    void *memory = vkb_alloc_pages(device, size, &made->host, &ignored);

    if (memory && import_types(device, memory) >> made->type & 1
        && import_pages(device, memory, size, made->type, &made->memory, &ignored)) {
        made->size = size;
        return true;
    }
    vkb_free(made->host);
    made->host = NULL;
    return false;
}

// Memory of a kind that fits the requirements. `next`: what extends VkMemoryAllocateInfo. `hosted`:
// the host's, if possible.
static bool allocate_kind(const struct vkb_device *device, enum vkb_memory_kind kind,
                          const VkMemoryRequirements *requirements, const void *next, bool hosted,
                          struct vkb_spares *spares, struct vkb_spare *made,
                          struct vkb_error *error)
{
    const uint32_t type = find_memory_type(device, kind, requirements->memoryTypeBits);
    const VkMemoryAllocateInfo info = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
        .pNext = next,
        .allocationSize = requirements->size,
        .memoryTypeIndex = type,
    };

    if (type == UINT32_MAX)
        return vkb_fail(error, VKB_ERROR_GENERAL, "the adapter has no memory type that fits");
    if (vkb_spares_take(spares, type, hosted, requirements->size, made))
        return true;
    *made = (struct vkb_spare){.size = requirements->size, .type = type};
    if (hosted && allocate_hosted(device, made))
        return true;
    bool done = allocate(device, &info, &made->memory, error);
    if (!done && spares && spares->count) {
        vkb_spares_free(device, spares);
        done = allocate(device, &info, &made->memory, error);
    }
    if (!done)
        vkb_add_words(error, ". One image or buffer of this call takes %.4g MiB",
                      (double)requirements->size / (1 << 20));
    return done;
}

// What a buffer is for, as captures name it.
static const char *buffer_name(VkBufferUsageFlags usage)
{
    return usage & VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT ? "uniforms"
         : usage & VK_BUFFER_USAGE_VERTEX_BUFFER_BIT  ? "vertices"
         : usage & VK_BUFFER_USAGE_INDEX_BUFFER_BIT   ? "indices"
         : usage & VK_BUFFER_USAGE_TRANSFER_SRC_BIT   ? "upload"
                                                      : "readback";
}

// Creates the handle of a buffer, whose memory has that external type; 0: none.
static bool create_buffer(const struct vkb_device *device, VkBufferUsageFlags usage,
                          VkDeviceSize size, VkExternalMemoryHandleTypeFlags type, VkBuffer *buffer,
                          struct vkb_error *error)
{
    const VkExternalMemoryBufferCreateInfo external = {
        .sType = VK_STRUCTURE_TYPE_EXTERNAL_MEMORY_BUFFER_CREATE_INFO,
        .handleTypes = type,
    };

    return VK(error, device->vk.vkCreateBuffer(device->handle,
                                               &(VkBufferCreateInfo){
                                                   .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
                                                   .pNext = type ? &external : NULL,
                                                   .size = size,
                                                   .usage = usage,
                                               },
                                               NULL, buffer));
}

// A buffer with its own memory, which can be exported as that type; 0: it is not.
static bool create(const struct vkb_device *device, enum vkb_memory_kind kind,
                   VkBufferUsageFlags usage, VkDeviceSize size,
                   VkExternalMemoryHandleTypeFlags type, struct vkb_buffer *buffer,
                   struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;
    VkMemoryRequirements requirements;
    struct vkb_spare made = {0};

    const bool hosted = device->linear_texels && device->import_alignment && type == 0
                     && kind != VKB_MEMORY_DEVICE && size >= VKB_LARGE_BYTES;

    *buffer = (struct vkb_buffer){0};
    if (!create_buffer(device, usage, size, hosted ? HOST_ALLOCATION : type, &buffer->handle,
                       error))
        return false;
    vk->vkGetBufferMemoryRequirements(device->handle, buffer->handle, &requirements);
    const VkMemoryDedicatedAllocateInfo dedicated = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_DEDICATED_ALLOCATE_INFO,
        .buffer = buffer->handle,
    };
    const VkExportMemoryAllocateInfo exported = {
        .sType = VK_STRUCTURE_TYPE_EXPORT_MEMORY_ALLOCATE_INFO,
        .pNext = &dedicated,
        .handleTypes = type,
    };
    const bool allocated = allocate_kind(device, kind, &requirements, type ? &exported : NULL,
                                         hosted, NULL, &made, error);
    buffer->memory = made.memory;
    buffer->host = made.host;
    if (!allocated
        || !VK(error, vk->vkBindBufferMemory(device->handle, buffer->handle, buffer->memory, 0))
        || (kind != VKB_MEMORY_DEVICE
            && !VK(error, vk->vkMapMemory(device->handle, buffer->memory, 0, VK_WHOLE_SIZE, 0,
                                          &buffer->mapped)))) {
        vkb_buffer_destroy(device, buffer);
        return false;
    }
    if (device->linear_texels && buffer->mapped)
        advise_large(buffer->mapped, (size_t)size);
    vkb_label_object(device, VK_OBJECT_TYPE_BUFFER, (uint64_t)buffer->handle, buffer_name(usage));
    // Only a complete buffer has a size; vkb_buffer_reserve relies on that.
    buffer->size = type ? requirements.size : size;
    buffer->coherent =
        device->memory.memoryTypes[made.type].propertyFlags & VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    return true;
}

bool vkb_buffer_create(const struct vkb_device *device, enum vkb_memory_kind kind,
                       VkBufferUsageFlags usage, VkDeviceSize size, struct vkb_buffer *buffer,
                       struct vkb_error *error)
{
    return create(device, kind, usage, size, 0, buffer, error);
}

bool vkb_buffer_export(const struct vkb_device *device, VkDeviceSize size,
                       struct vkb_buffer *buffer, int *descriptor, struct vkb_error *error)
{
    const VkExternalMemoryHandleTypeFlagBits type = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT;

    if (!create(device, VKB_MEMORY_DEVICE, VKB_EXPORT_USAGE, size, type, buffer, error))
        return false;
    if (VK(error, device->vk.vkGetMemoryFdKHR(device->handle,
                                              &(VkMemoryGetFdInfoKHR){
                                                  .sType = VK_STRUCTURE_TYPE_MEMORY_GET_FD_INFO_KHR,
                                                  .memory = buffer->memory,
                                                  .handleType = type,
                                              },
                                              descriptor)))
        return true;
    vkb_buffer_destroy(device, buffer);
    return false;
}

void vkb_buffer_destroy(const struct vkb_device *device, struct vkb_buffer *buffer)
{
    device->vk.vkDestroyBuffer(device->handle, buffer->handle, NULL);
    vkb_memory_free(device, buffer->memory, buffer->host);
    *buffer = (struct vkb_buffer){0};
}

bool vkb_buffer_reserve(const struct vkb_device *device, enum vkb_memory_kind kind,
                        VkBufferUsageFlags usage, VkDeviceSize size, struct vkb_buffer *buffer,
                        struct vkb_error *error)
{
    if (buffer->size >= size)
        return true;
    vkb_buffer_destroy(device, buffer);
    return vkb_buffer_create(device, kind, usage, size, buffer, error);
}

// The first coherent memory type for the host memory; UINT32_MAX if there is none.
static uint32_t find_import_type(const struct vkb_device *device, void *memory, uint32_t allowed)
{
    const uint32_t types = allowed & import_types(device, memory);

    for (uint32_t i = 0; i < device->memory.memoryTypeCount; ++i)
        if (types >> i & 1
            && device->memory.memoryTypes[i].propertyFlags & VK_MEMORY_PROPERTY_HOST_COHERENT_BIT)
            return i;
    return UINT32_MAX;
}

static bool import_memory(const struct vkb_device *device, void *memory, struct vkb_buffer *buffer,
                          struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;
    VkMemoryRequirements requirements;

    vk->vkGetBufferMemoryRequirements(device->handle, buffer->handle, &requirements);
    const uint32_t type = find_import_type(device, memory, requirements.memoryTypeBits);
    return type != UINT32_MAX && requirements.size <= buffer->size
        && import_pages(device, memory, buffer->size, type, &buffer->memory, error)
        && VK(error, vk->vkBindBufferMemory(device->handle, buffer->handle, buffer->memory, 0));
}

bool vkb_buffer_import(const struct vkb_device *device, VkBufferUsageFlags usage, void *memory,
                       size_t size, struct vkb_buffer *buffer, VkDeviceSize *offset)
{
    const VkDeviceSize align = device->import_alignment;
    struct vkb_error ignored;

    *buffer = (struct vkb_buffer){0};
    if (align == 0)
        return false;
    *offset = (uintptr_t)memory % align;
    buffer->size = (*offset + size + align - 1) / align * align;
    if (!create_buffer(device, usage, buffer->size, HOST_ALLOCATION, &buffer->handle, &ignored)
        || !import_memory(device, (char *)memory - *offset, buffer, &ignored)) {
        vkb_buffer_destroy(device, buffer);
        return false;
    }
    buffer->coherent = true;
    return true;
}

static VkMappedMemoryRange full_range(const struct vkb_buffer *buffer)
{
    return (VkMappedMemoryRange){
        .sType = VK_STRUCTURE_TYPE_MAPPED_MEMORY_RANGE,
        .memory = buffer->memory,
        .size = VK_WHOLE_SIZE,
    };
}

bool vkb_buffer_flush(const struct vkb_device *device, const struct vkb_buffer *buffer,
                      struct vkb_error *error)
{
    VkMappedMemoryRange range = full_range(buffer);

    return buffer->coherent
        || VK(error, device->vk.vkFlushMappedMemoryRanges(device->handle, 1, &range));
}

bool vkb_buffer_invalidate(const struct vkb_device *device, const struct vkb_buffer *buffer,
                           struct vkb_error *error)
{
    VkMappedMemoryRange range = full_range(buffer);

    return buffer->coherent
        || VK(error, device->vk.vkInvalidateMappedMemoryRanges(device->handle, 1, &range));
}

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
        .handleTypes = HOST_ALLOCATION,
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
        .handleType = HOST_ALLOCATION,
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
    return round_up((size_t)width * vkb_pixel_size(format), 256);
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
    if (!create_buffer(device,
                       VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT
                           | VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                       buffer_size(image), image->hosted ? HOST_ALLOCATION : 0, &image->buffer,
                       error))
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
    advise_large(image->mapped, image->row_pitch * image->height);
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
        && allocate_kind(device, spec->mapped ? VKB_MEMORY_SHARED : VKB_MEMORY_DEVICE,
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
