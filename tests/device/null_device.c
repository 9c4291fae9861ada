// A Vulkan layer for tests: a driver without its hardware. The driver below makes shader modules,
// layouts, pipelines and descriptors, and tells formats and limits. Memory is the host's, images
// and buffers are their sizes, and commands do nothing. amd_families.py builds and uses it.
#include "../core/layer.h"

#include <stdlib.h>

#define CALL      VKAPI_ATTR VkResult VKAPI_CALL
#define CALL_VOID VKAPI_ATTR void VKAPI_CALL

enum { PAGE = 4096, TYPES = 3, TEXEL = 16 };

// A handle of any kind; `bytes` is what a buffer, an image or its row needs.
struct object {
    VkDeviceSize bytes, row;
    void *contents;
    bool is_own;
};

static VkResult create(VkDeviceSize bytes, VkDeviceSize row, void *handle)
{
    struct object *made = malloc(sizeof *made);

    if (!made)
        return VK_ERROR_OUT_OF_HOST_MEMORY;
    *made = (struct object){.bytes = bytes, .row = row};
    memcpy(handle, &made, sizeof made);
    return VK_SUCCESS;
}

static CALL create_any(VkDevice device, const void *info, const VkAllocationCallbacks *callbacks,
                       void *handle)
{
    (void)device, (void)info, (void)callbacks;
    return create(0, 0, handle);
}

static CALL_VOID destroy_any(VkDevice device, struct object *object,
                             const VkAllocationCallbacks *callbacks)
{
    (void)device, (void)callbacks;
    if (object && object->is_own)
        free(object->contents);
    free(object);
}

static CALL create_buffer(VkDevice device, const VkBufferCreateInfo *info,
                          const VkAllocationCallbacks *callbacks, VkBuffer *buffer)
{
    (void)device, (void)callbacks;
    return create(info->size, 0, buffer);
}

static CALL create_image(VkDevice device, const VkImageCreateInfo *info,
                         const VkAllocationCallbacks *callbacks, VkImage *image)
{
    const VkDeviceSize row = (VkDeviceSize)info->extent.width * TEXEL;

    (void)device, (void)callbacks;
    // Levels of smaller sizes take less than the first one again.
    return create(row * info->extent.height * info->arrayLayers * (1 + (info->mipLevels > 1)), row,
                  image);
}

static CALL_VOID get_requirements(VkDevice device, const struct object *object,
                                  VkMemoryRequirements *requirements)
{
    (void)device;
    *requirements = (VkMemoryRequirements){
        .size = (object->bytes + PAGE - 1) / PAGE * PAGE,
        .alignment = PAGE,
        .memoryTypeBits = (1u << TYPES) - 1,
    };
}

static CALL_VOID get_layout(VkDevice device, const struct object *image,
                            const VkImageSubresource *part, VkSubresourceLayout *layout)
{
    (void)device, (void)part;
    *layout = (VkSubresourceLayout){.size = image->bytes, .rowPitch = image->row};
}

// The device's own memory, and the host's without and with a cache, as GPUs have it.
static CALL_VOID get_memory(VkPhysicalDevice physical, VkPhysicalDeviceMemoryProperties *memory)
{
    const VkMemoryPropertyFlags shared =
        VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;

    (void)physical;
    *memory = (VkPhysicalDeviceMemoryProperties){
        .memoryTypeCount = TYPES,
        .memoryTypes = {{VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0},
                        {shared, 1},
                        {shared | VK_MEMORY_PROPERTY_HOST_CACHED_BIT, 1}},
        .memoryHeapCount = 2,
        .memoryHeaps = {{1ull << 33, VK_MEMORY_HEAP_DEVICE_LOCAL_BIT}, {1ull << 33, 0}},
    };
}

static CALL_VOID get_memory2(VkPhysicalDevice physical, VkPhysicalDeviceMemoryProperties2 *memory)
{
    get_memory(physical, &memory->memoryProperties);
}

static CALL get_host_pointer(VkDevice device, VkExternalMemoryHandleTypeFlagBits type,
                             const void *pointer, VkMemoryHostPointerPropertiesEXT *properties)
{
    (void)device, (void)type, (void)pointer;
    properties->memoryTypeBits = 1u << (TYPES - 1);
    return VK_SUCCESS;
}

static CALL allocate(VkDevice device, const VkMemoryAllocateInfo *info,
                     const VkAllocationCallbacks *callbacks, VkDeviceMemory *memory)
{
    struct object *made;
    const VkResult result = create_any(device, info, callbacks, memory);

    if (result != VK_SUCCESS)
        return result;
    memcpy(&made, memory, sizeof made);
    for (const VkBaseInStructure *next = info->pNext; next; next = next->pNext)
        if (next->sType == VK_STRUCTURE_TYPE_IMPORT_MEMORY_HOST_POINTER_INFO_EXT)
            made->contents = ((const VkImportMemoryHostPointerInfoEXT *)next)->pHostPointer;
    made->is_own = !made->contents;
    if (made->is_own)
        made->contents = calloc(1, info->allocationSize);
    return made->contents ? VK_SUCCESS : VK_ERROR_OUT_OF_DEVICE_MEMORY;
}

static CALL map(VkDevice device, const struct object *memory, VkDeviceSize offset,
                VkDeviceSize size, VkMemoryMapFlags flags, void **data)
{
    (void)device, (void)size, (void)flags;
    *data = (char *)memory->contents + offset;
    return VK_SUCCESS;
}

static CALL get_queries(VkDevice device, VkQueryPool pool, uint32_t first, uint32_t count,
                        size_t size, void *data, VkDeviceSize stride, VkQueryResultFlags flags)
{
    (void)device, (void)pool, (void)first, (void)count, (void)stride, (void)flags;
    memset(data, 0, size);
    return VK_SUCCESS;
}

// For functions of any arguments: with the calling conventions of Linux the caller owns them.
static CALL succeed(void)
{
    return VK_SUCCESS;
}

#define OWN(name, function) ENTRY(name, function, true)
#define PAIR(kind)          OWN(vkCreate##kind, create_any), OWN(vkDestroy##kind, destroy_any)
static const struct entry entries[] = {
    OWN(vkGetInstanceProcAddr, get_instance_proc),
    OWN(vkGetDeviceProcAddr, get_device_proc),
    OWN(vkCreateInstance, begin_instance),
    OWN(vkCreateDevice, begin_device),
    OWN(vkGetPhysicalDeviceMemoryProperties, get_memory),
    OWN(vkGetPhysicalDeviceMemoryProperties2, get_memory2),
    OWN(vkGetPhysicalDeviceMemoryProperties2KHR, get_memory2),
    OWN(vkGetMemoryHostPointerPropertiesEXT, get_host_pointer),
    OWN(vkAllocateMemory, allocate),
    OWN(vkFreeMemory, destroy_any),
    OWN(vkMapMemory, map),
    OWN(vkUnmapMemory, succeed),
    OWN(vkFlushMappedMemoryRanges, succeed),
    OWN(vkInvalidateMappedMemoryRanges, succeed),
    OWN(vkCreateBuffer, create_buffer),
    OWN(vkDestroyBuffer, destroy_any),
    OWN(vkGetBufferMemoryRequirements, get_requirements),
    OWN(vkBindBufferMemory, succeed),
    OWN(vkCreateImage, create_image),
    OWN(vkDestroyImage, destroy_any),
    OWN(vkGetImageMemoryRequirements, get_requirements),
    OWN(vkGetImageSubresourceLayout, get_layout),
    OWN(vkBindImageMemory, succeed),
    PAIR(BufferView),
    PAIR(ImageView),
    PAIR(QueryPool),
    PAIR(Fence),
    OWN(vkGetQueryPoolResults, get_queries),
    OWN(vkResetFences, succeed),
    OWN(vkGetFenceStatus, succeed),
    OWN(vkWaitForFences, succeed),
    OWN(vkQueueSubmit, succeed),
    OWN(vkQueueWaitIdle, succeed),
    OWN(vkUpdateDescriptorSets, succeed),
    OWN(vkBeginCommandBuffer, succeed),
    OWN(vkEndCommandBuffer, succeed),
    OWN(vkResetCommandBuffer, succeed),
    OWN(vkResetCommandPool, succeed),
    OWN(vkSetDebugUtilsObjectNameEXT, succeed),
};

static PFN_vkVoidFunction find_own(const char *name, bool of_device)
{
    const size_t count = sizeof entries / sizeof entries[0];
    const PFN_vkVoidFunction found = find_entry(entries, count, name, of_device);

    return found || strncmp(name, "vkCmd", 5) != 0 ? found : (PFN_vkVoidFunction)succeed;
}
