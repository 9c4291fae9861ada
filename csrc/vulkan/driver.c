#include "vulkan/driver.h"

#include <stdint.h>

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

// Drivers keep the lowest version that was ever negotiated, and a loader opens a single driver
// (VK_LUNARG_direct_driver_loading, for validation) of version 7 alone.
enum { INTERFACE_VERSION = 7 };

typedef VkResult(VKAPI_PTR *negotiate_function)(uint32_t *version);

#ifdef _WIN32
static void *open_library(const char *path)
{
    return (void *)LoadLibraryA(path);
}

static void *find_function(void *library, const char *name)
{
    return (void *)GetProcAddress((HMODULE)library, name);
}

static const char *last_reason(void)
{
    return "the system cannot load it";
}
#else
static void *open_library(const char *path)
{
    return dlopen(path, RTLD_NOW | RTLD_LOCAL);
}

static void *find_function(void *library, const char *name)
{
    return dlsym(library, name);
}

static const char *last_reason(void)
{
    const char *reason = dlerror();

    return reason ? reason : "no reason is given";
}
#endif

PFN_vkGetInstanceProcAddr vkb_driver_open(const char *path, struct vkb_error *error)
{
    uint32_t version = INTERFACE_VERSION;
    void *library = open_library(path);

    if (!library) {
        vkb_fail(error, VKB_ERROR_ADAPTER_NOT_FOUND, "the driver %s does not open: %s", path,
                 last_reason());
        return NULL;
    }
    negotiate_function negotiate =
        (negotiate_function)find_function(library, "vk_icdNegotiateLoaderICDInterfaceVersion");
    PFN_vkGetInstanceProcAddr get =
        (PFN_vkGetInstanceProcAddr)find_function(library, "vk_icdGetInstanceProcAddr");
    if (!negotiate || !get) {
        vkb_fail(error, VKB_ERROR_ADAPTER_NOT_FOUND,
                 "%s is no Vulkan driver: it lacks vk_icdGetInstanceProcAddr or "
                 "vk_icdNegotiateLoaderICDInterfaceVersion",
                 path);
        return NULL;
    }
    return VK(error, negotiate(&version)) ? get : NULL;
}
