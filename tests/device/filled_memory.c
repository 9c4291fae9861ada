// A Vulkan layer for tests: it fills new memory that the host can map with the byte VKBLOOM_FILL.
// Undefined content of images and buffers is usually 0, or what an earlier call left.
// test_filled_memory.py uses it.
#include "../core/layer.h"

#include <stdlib.h>

// Of the first device, and good for all.
static struct {
    PFN_vkAllocateMemory vkAllocateMemory;
    PFN_vkMapMemory vkMapMemory;
    PFN_vkUnmapMemory vkUnmapMemory;
} below;

// Whether the memory has a content that is not undefined.
static bool is_imported(const VkMemoryAllocateInfo *info)
{
    const VkBaseInStructure *next = info->pNext;

    while (next && next->sType != VK_STRUCTURE_TYPE_IMPORT_MEMORY_HOST_POINTER_INFO_EXT
           && next->sType != VK_STRUCTURE_TYPE_IMPORT_MEMORY_FD_INFO_KHR)
        next = next->pNext;
    return next;
}

static VKAPI_ATTR VkResult VKAPI_CALL allocate(VkDevice device, const VkMemoryAllocateInfo *info,
                                               const VkAllocationCallbacks *callbacks,
                                               VkDeviceMemory *memory)
{
    const char *byte = getenv("VKBLOOM_FILL");
    const VkResult result = below.vkAllocateMemory(device, info, callbacks, memory);
    void *mapped;

    if (result == VK_SUCCESS && byte && !is_imported(info)
        && below.vkMapMemory(device, *memory, 0, VK_WHOLE_SIZE, 0, &mapped) == VK_SUCCESS) {
        memset(mapped, (int)strtol(byte, NULL, 16), info->allocationSize);
        below.vkUnmapMemory(device, *memory);
    }
    return result;
}

static VKAPI_ATTR VkResult VKAPI_CALL create_device(VkPhysicalDevice physical,
                                                    const VkDeviceCreateInfo *info,
                                                    const VkAllocationCallbacks *callbacks,
                                                    VkDevice *created)
{
    const VkResult result = begin_device(physical, info, callbacks, created);
#define FETCH(name) below.name = (PFN_##name)chain.device_proc(*created, #name);
    if (result == VK_SUCCESS) {
        FETCH(vkAllocateMemory)
        FETCH(vkMapMemory)
        FETCH(vkUnmapMemory)
    }
#undef FETCH
    return result;
}

static const struct entry entries[] = {
    ENTRY(vkGetInstanceProcAddr, get_instance_proc, false),
    ENTRY(vkCreateInstance, begin_instance, false), ENTRY(vkCreateDevice, create_device, false),
    ENTRY(vkGetDeviceProcAddr, get_device_proc, true), ENTRY(vkAllocateMemory, allocate, true)};

static PFN_vkVoidFunction find_own(const char *name, bool of_device)
{
    return find_entry(entries, sizeof entries / sizeof entries[0], name, of_device);
}
