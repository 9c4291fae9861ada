// libvulkan.so.1 for systems without the Vulkan loader: hands programs that look for the loader on
// to the driver beside it. It knows this driver alone, no layers and no windows.
#include <stdint.h>
#include <string.h>

typedef void (*function)(void);
typedef int32_t result;

function vk_icdGetInstanceProcAddr(void *instance, const char *name);
result vk_icdNegotiateLoaderICDInterfaceVersion(uint32_t *version);

// As of the loader, which lists layers.
result vkEnumerateInstanceLayerProperties(uint32_t *count, void *layers)
{
    (void)layers;
    *count = 0;
    return 0;
}

static result no_device_layers(void *device, uint32_t *count, void *layers)
{
    (void)device;
    return vkEnumerateInstanceLayerProperties(count, layers);
}

function vkGetInstanceProcAddr(void *instance, const char *name)
{
    // Drivers of this interface may be called without a loader.
    uint32_t version = 7;
    vk_icdNegotiateLoaderICDInterfaceVersion(&version);
    if (strcmp(name, "vkGetInstanceProcAddr") == 0)
        return (function)vkGetInstanceProcAddr;
    if (strcmp(name, "vkEnumerateInstanceLayerProperties") == 0)
        return (function)vkEnumerateInstanceLayerProperties;
    if (strcmp(name, "vkEnumerateDeviceLayerProperties") == 0)
        return (function)no_device_layers;
    return vk_icdGetInstanceProcAddr(instance, name);
}

function vkGetDeviceProcAddr(void *device, const char *name)
{
    typedef function (*get)(void *device, const char *name);
    get of_driver = (get)vk_icdGetInstanceProcAddr(NULL, "vkGetDeviceProcAddr");
    return of_driver ? of_driver(device, name) : NULL;
}

result vkEnumerateInstanceVersion(uint32_t *version)
{
    typedef result (*get)(uint32_t *version);
    return ((get)vkGetInstanceProcAddr(NULL, "vkEnumerateInstanceVersion"))(version);
}

result vkEnumerateInstanceExtensionProperties(const char *layer, uint32_t *count, void *extensions)
{
    typedef result (*get)(const char *layer, uint32_t *count, void *extensions);
    return ((get)vkGetInstanceProcAddr(NULL, "vkEnumerateInstanceExtensionProperties"))(
        layer, count, extensions);
}

result vkCreateInstance(const void *info, const void *memory, void **instance)
{
    typedef result (*get)(const void *info, const void *memory, void **instance);
    return ((get)vkGetInstanceProcAddr(NULL, "vkCreateInstance"))(info, memory, instance);
}
