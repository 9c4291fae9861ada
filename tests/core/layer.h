// What the Vulkan layers of the tests share: their place in the loader's chain, and the look-up of
// their functions. A layer defines find_own, and ends its chains with begin_instance and
// begin_device.
#ifndef VKB_TESTS_LAYER_H
#define VKB_TESTS_LAYER_H

#include <stdbool.h>
#include <string.h>
// clang-format off: the second one leaves out what the first one has
#include <vulkan/vulkan.h>
#include <vulkan/vk_layer.h>
// clang-format on

// What is below, of the instance and the device that were created last.
static struct {
    VkInstance instance;
    PFN_vkGetInstanceProcAddr instance_proc;
    PFN_vkGetDeviceProcAddr device_proc;
    PFN_vkSubmitDebugUtilsMessageEXT message;
} chain;

struct entry {
    const char *name;
    PFN_vkVoidFunction function;
    bool of_device;
};
#define ENTRY(name, function, of_device) {#name, (PFN_vkVoidFunction)function, of_device}

// The layer's function of a name, or NULL: that below is used.
static PFN_vkVoidFunction find_own(const char *name, bool of_device);

static inline PFN_vkVoidFunction find_entry(const struct entry *entries, size_t count,
                                            const char *name, bool of_device)
{
    for (size_t i = 0; i < count; ++i)
        if (strcmp(entries[i].name, name) == 0 && (entries[i].of_device || !of_device))
            return entries[i].function;
    return NULL;
}

static VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL get_instance_proc(VkInstance handle,
                                                                  const char *name)
{
    PFN_vkVoidFunction found = find_own(name, false);

    return found || !handle ? found : chain.instance_proc(handle, name);
}

static VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL get_device_proc(VkDevice handle, const char *name)
{
    PFN_vkVoidFunction found = find_own(name, true);

    return found ? found : chain.device_proc(handle, name);
}

// Creates the instance below.
static inline VKAPI_ATTR VkResult VKAPI_CALL begin_instance(const VkInstanceCreateInfo *info,
                                                            const VkAllocationCallbacks *callbacks,
                                                            VkInstance *created)
{
    VkLayerInstanceCreateInfo *link = (VkLayerInstanceCreateInfo *)info->pNext;

    while (link->sType != VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO
           || link->function != VK_LAYER_LINK_INFO)
        link = (VkLayerInstanceCreateInfo *)link->pNext;
    chain.instance_proc = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    link->u.pLayerInfo = link->u.pLayerInfo->pNext;
    const PFN_vkCreateInstance create =
        (PFN_vkCreateInstance)chain.instance_proc(VK_NULL_HANDLE, "vkCreateInstance");
    const VkResult result = create(info, callbacks, created);
    if (result == VK_SUCCESS) {
        chain.instance = *created;
        chain.message = (PFN_vkSubmitDebugUtilsMessageEXT)chain.instance_proc(
            *created, "vkSubmitDebugUtilsMessageEXT");
    }
    return result;
}

// Creates the device below.
static inline VKAPI_ATTR VkResult VKAPI_CALL begin_device(VkPhysicalDevice physical,
                                                          const VkDeviceCreateInfo *info,
                                                          const VkAllocationCallbacks *callbacks,
                                                          VkDevice *created)
{
    VkLayerDeviceCreateInfo *link = (VkLayerDeviceCreateInfo *)info->pNext;

    while (link->sType != VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO
           || link->function != VK_LAYER_LINK_INFO)
        link = (VkLayerDeviceCreateInfo *)link->pNext;
    chain.device_proc = link->u.pLayerInfo->pfnNextGetDeviceProcAddr;
    const PFN_vkCreateDevice create =
        (PFN_vkCreateDevice)link->u.pLayerInfo->pfnNextGetInstanceProcAddr(chain.instance,
                                                                           "vkCreateDevice");
    link->u.pLayerInfo = link->u.pLayerInfo->pNext;
    return create(physical, info, callbacks, created);
}

// Sends a message like one of the validation layer.
static inline void object(const char *text)
{
    chain.message(chain.instance, VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
                  VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT,
                  &(VkDebugUtilsMessengerCallbackDataEXT){
                      .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CALLBACK_DATA_EXT,
                      .pMessage = text,
                  });
}

VK_LAYER_EXPORT VKAPI_ATTR VkResult VKAPI_CALL
vkNegotiateLoaderLayerInterfaceVersion(VkNegotiateLayerInterface *layer)
{
    layer->loaderLayerInterfaceVersion = 2;
    layer->pfnGetInstanceProcAddr = get_instance_proc;
    layer->pfnGetDeviceProcAddr = get_device_proc;
    layer->pfnGetPhysicalDeviceProcAddr = NULL;
    return VK_SUCCESS;
}

#endif
