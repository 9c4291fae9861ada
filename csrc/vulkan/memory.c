// madvise and its flags are no part of C11.
#define _DEFAULT_SOURCE
#include "vulkan/memory.h"

#include "vulkan/labels.h"

#ifdef __linux__
#include <sys/mman.h>
#endif

enum { LARGE_PAGE = 2 << 20 };

static size_t round_up(size_t size, size_t step)
{
    return (size + step - 1) / step * step;
}

void vkb_advise_large(void *memory, size_t size)
{
#ifdef MADV_HUGEPAGE
    // The range must start at a page. Where the system has no large ones, nothing is lost.
    const size_t skipped = (size_t)(-(uintptr_t)memory % VKB_SMALL_PAGE);
    if (size >= VKB_LARGE_BYTES)
        (void)madvise((char *)memory + skipped, size - skipped, MADV_HUGEPAGE);
#else
    (void)memory, (void)size;
#endif
}

// The smallest pages that the device can import.
static size_t page_of(const struct vkb_device *device)
{
    return device && device->import_alignment > VKB_SMALL_PAGE ? (size_t)device->import_alignment
                                                               : VKB_SMALL_PAGE;
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
    vkb_advise_large(memory, vkb_size_of_pages(device, size));
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

// The memory types that the host memory can be imported as; 0: none.
static uint32_t import_types(const struct vkb_device *device, void *memory)
{
    VkMemoryHostPointerPropertiesEXT properties = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_HOST_POINTER_PROPERTIES_EXT,
    };

    return VK_RESULT(device->vk.vkGetMemoryHostPointerPropertiesEXT(
               device->handle, VKB_HOST_ALLOCATION, memory, &properties))
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
                                .handleType = VKB_HOST_ALLOCATION,
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

bool vkb_memory_allocate(const struct vkb_device *device, enum vkb_memory_kind kind,
                         const VkMemoryRequirements *requirements, const void *next, bool hosted,
                         struct vkb_spares *spares, struct vkb_spare *made, struct vkb_error *error)
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

bool vkb_buffer_create_handle(const struct vkb_device *device, VkBufferUsageFlags usage,
                              VkDeviceSize size, VkExternalMemoryHandleTypeFlags type,
                              VkBuffer *buffer, struct vkb_error *error)
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
    if (!vkb_buffer_create_handle(device, usage, size, hosted ? VKB_HOST_ALLOCATION : type,
                                  &buffer->handle, error))
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
    const bool allocated = vkb_memory_allocate(device, kind, &requirements, type ? &exported : NULL,
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
        vkb_advise_large(buffer->mapped, (size_t)size);
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
    if (!vkb_buffer_create_handle(device, usage, buffer->size, VKB_HOST_ALLOCATION, &buffer->handle,
                                  &ignored)
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
