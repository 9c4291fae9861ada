// A Vulkan layer for tests: a driver without its hardware. The driver below makes shader modules,
// layouts, pipelines and descriptors, and tells formats and limits. Memory is the host's, images
// and buffers are their sizes, and commands do nothing. amd_families.py builds and uses it.
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <vulkan/vk_layer.h>

#define EXPORT    __attribute__((visibility("default")))
#define CALL      VKAPI_ATTR VkResult VKAPI_CALL
#define CALL_VOID VKAPI_ATTR void VKAPI_CALL

enum { PAGE = 4096, TYPES = 3, TEXEL = 16 };

static struct {
    VkInstance instance;
    PFN_vkGetInstanceProcAddr instance_proc;
    PFN_vkGetDeviceProcAddr device_proc;
} below;

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

// Takes itself out of the chain that the loader made; returns the next function.
static PFN_vkGetInstanceProcAddr next_of(const void *chain, VkStructureType type,
                                         PFN_vkGetDeviceProcAddr *device_proc)
{
    VkLayerDeviceCreateInfo *link = (VkLayerDeviceCreateInfo *)chain;

    while (link->sType != type || link->function != VK_LAYER_LINK_INFO)
        link = (VkLayerDeviceCreateInfo *)link->pNext;
    const PFN_vkGetInstanceProcAddr next = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    if (device_proc) {
        *device_proc = link->u.pLayerInfo->pfnNextGetDeviceProcAddr;
        link->u.pLayerInfo = link->u.pLayerInfo->pNext;
        return next;
    }
    VkLayerInstanceCreateInfo *of_instance = (VkLayerInstanceCreateInfo *)link;
    of_instance->u.pLayerInfo = of_instance->u.pLayerInfo->pNext;
    return next;
}

static CALL create_instance(const VkInstanceCreateInfo *info,
                            const VkAllocationCallbacks *callbacks, VkInstance *instance)
{
    below.instance_proc = next_of(info->pNext, VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO, NULL);
    const PFN_vkCreateInstance function =
        (PFN_vkCreateInstance)below.instance_proc(NULL, "vkCreateInstance");
    const VkResult result = function(info, callbacks, instance);

    below.instance = *instance;
    return result;
}

static CALL create_device(VkPhysicalDevice physical, const VkDeviceCreateInfo *info,
                          const VkAllocationCallbacks *callbacks, VkDevice *device)
{
    const PFN_vkGetInstanceProcAddr next =
        next_of(info->pNext, VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO, &below.device_proc);

    return ((PFN_vkCreateDevice)next(below.instance, "vkCreateDevice"))(physical, info, callbacks,
                                                                        device);
}

static PFN_vkVoidFunction get_instance_proc(VkInstance handle, const char *name);
static PFN_vkVoidFunction get_device_proc(VkDevice handle, const char *name);

#define ENTRY(name, function) {#name, (PFN_vkVoidFunction)function}
#define PAIR(kind)            ENTRY(vkCreate##kind, create_any), ENTRY(vkDestroy##kind, destroy_any)
static const struct entry {
    const char *name;
    PFN_vkVoidFunction function;
} entries[] = {
    ENTRY(vkGetInstanceProcAddr, get_instance_proc),
    ENTRY(vkGetDeviceProcAddr, get_device_proc),
    ENTRY(vkCreateInstance, create_instance),
    ENTRY(vkCreateDevice, create_device),
    ENTRY(vkGetPhysicalDeviceMemoryProperties, get_memory),
    ENTRY(vkGetPhysicalDeviceMemoryProperties2, get_memory2),
    ENTRY(vkGetPhysicalDeviceMemoryProperties2KHR, get_memory2),
    ENTRY(vkGetMemoryHostPointerPropertiesEXT, get_host_pointer),
    ENTRY(vkAllocateMemory, allocate),
    ENTRY(vkFreeMemory, destroy_any),
    ENTRY(vkMapMemory, map),
    ENTRY(vkUnmapMemory, succeed),
    ENTRY(vkFlushMappedMemoryRanges, succeed),
    ENTRY(vkInvalidateMappedMemoryRanges, succeed),
    ENTRY(vkCreateBuffer, create_buffer),
    ENTRY(vkDestroyBuffer, destroy_any),
    ENTRY(vkGetBufferMemoryRequirements, get_requirements),
    ENTRY(vkBindBufferMemory, succeed),
    ENTRY(vkCreateImage, create_image),
    ENTRY(vkDestroyImage, destroy_any),
    ENTRY(vkGetImageMemoryRequirements, get_requirements),
    ENTRY(vkGetImageSubresourceLayout, get_layout),
    ENTRY(vkBindImageMemory, succeed),
    PAIR(BufferView),
    PAIR(ImageView),
    PAIR(Framebuffer),
    PAIR(QueryPool),
    PAIR(Fence),
    ENTRY(vkGetQueryPoolResults, get_queries),
    ENTRY(vkResetFences, succeed),
    ENTRY(vkGetFenceStatus, succeed),
    ENTRY(vkWaitForFences, succeed),
    ENTRY(vkQueueSubmit, succeed),
    ENTRY(vkQueueWaitIdle, succeed),
    ENTRY(vkUpdateDescriptorSets, succeed),
    ENTRY(vkBeginCommandBuffer, succeed),
    ENTRY(vkEndCommandBuffer, succeed),
    ENTRY(vkResetCommandBuffer, succeed),
    ENTRY(vkResetCommandPool, succeed),
    ENTRY(vkSetDebugUtilsObjectNameEXT, succeed),
};

static PFN_vkVoidFunction find(const char *name)
{
    for (size_t i = 0; i < sizeof entries / sizeof entries[0]; ++i)
        if (strcmp(entries[i].name, name) == 0)
            return entries[i].function;
    return strncmp(name, "vkCmd", 5) == 0 ? (PFN_vkVoidFunction)succeed : NULL;
}

static PFN_vkVoidFunction get_instance_proc(VkInstance handle, const char *name)
{
    const PFN_vkVoidFunction found = find(name);

    return found ? found : below.instance_proc(handle, name);
}

static PFN_vkVoidFunction get_device_proc(VkDevice handle, const char *name)
{
    const PFN_vkVoidFunction found = find(name);

    return found ? found : below.device_proc(handle, name);
}

EXPORT CALL vkNegotiateLoaderLayerInterfaceVersion(VkNegotiateLayerInterface *layer)
{
    layer->loaderLayerInterfaceVersion = 2;
    layer->pfnGetInstanceProcAddr = get_instance_proc;
    layer->pfnGetDeviceProcAddr = get_device_proc;
    layer->pfnGetPhysicalDeviceProcAddr = NULL;
    return VK_SUCCESS;
}
