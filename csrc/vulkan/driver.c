#include "vulkan/driver.h"

#include <stdint.h>

#include <dlfcn.h>

// Drivers keep the lowest version that was ever negotiated, and a loader opens a single driver
// (VK_LUNARG_direct_driver_loading, for validation) of version 7 alone.
enum { INTERFACE_VERSION = 7 };

typedef VkResult(VKAPI_PTR *negotiate_function)(uint32_t *version);

PFN_vkGetInstanceProcAddr vkb_driver_open(const char *path, struct vkb_error *error)
{
    uint32_t version = INTERFACE_VERSION;
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);

    if (!library) {
        const char *reason = dlerror();
        vkb_fail(error, VKB_ERROR_ADAPTER_NOT_FOUND, "the driver %s does not open: %s", path,
                 reason ? reason : "no reason is given");
        return NULL;
    }
    negotiate_function negotiate =
        (negotiate_function)dlsym(library, "vk_icdNegotiateLoaderICDInterfaceVersion");
    PFN_vkGetInstanceProcAddr get =
        (PFN_vkGetInstanceProcAddr)dlsym(library, "vk_icdGetInstanceProcAddr");
    if (!negotiate || !get) {
        vkb_fail(error, VKB_ERROR_ADAPTER_NOT_FOUND,
                 "%s is no Vulkan driver: it lacks vk_icdGetInstanceProcAddr or "
                 "vk_icdNegotiateLoaderICDInterfaceVersion",
                 path);
        return NULL;
    }
    return VK(error, negotiate(&version)) ? get : NULL;
}
