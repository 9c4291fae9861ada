#include "vulkan/instance.h"

#include "vulkan/messages.h"
#include "vulkan/parts.h"
#include "vulkan/process.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <dlfcn.h>

#define VALIDATION_LAYER "VK_LAYER_KHRONOS_validation"

const char vkb_install_hint[] =
    "For a driver that runs on any CPU, install the package vkbloom-lavapipe, or on Debian or "
    "Ubuntu: apt install libvulkan1 mesa-vulkan-drivers; for a GPU, install its vendor's Vulkan "
    "driver. `vkbloom doctor` tells more.";

// Of address space. The loader loads the libraries of all drivers; lavapipe's, with LLVM, takes
// 400 MiB.
enum { MIN_MIB = 448 };

// Each thread of lavapipe takes up to 144 MiB for its stacks and allocations. Other drivers of CPUs
// end the process where a thread of theirs has no room: SwiftShader's take up to 96 MiB.
static size_t driver_mib(bool lavapipe)
{
    const unsigned long cores = vkb_core_count(), most = lavapipe ? 32 : 16;
    const char *text = lavapipe ? getenv("LP_NUM_THREADS") : NULL;
    const unsigned long threads = text ? strtoul(text, NULL, 10) : cores;

    return MIN_MIB + (lavapipe ? 144 : 96) * (threads < most ? threads : most);
}

// Held while an instance is created, which may take long: libraries are loaded and run code of
// their own. It protects volk's functions of the loader.
static struct vkb_lock creation;
static bool loader_open;
// Held for short times: it protects the list of instances and volk's function for devices. Whoever
// takes both takes this one last.
static struct vkb_lock lock;
static struct vkb_instance *instances;
// Whether this process was forked from one with an instance. At exit Mesa (22.3.6) waits for the
// driver threads of the parent, which do not exist here. It mistakes threads of the child for them
// if their stacks have the same addresses. So no driver thread of the child may be left at exit.
static bool forked;

// The result of the loader does not always name the cause if there is no adapter.
static bool check_created(VkResult result, bool direct, struct vkb_error *error)
{
    if (result == VK_ERROR_LAYER_NOT_PRESENT)
        return vkb_fail(error, VKB_ERROR_GENERAL,
                        "validation was asked for, but %s is not installed. "
                        "On Debian or Ubuntu: apt install vulkan-validationlayers",
                        VALIDATION_LAYER);
    // Loaders open single drivers from 1.3.234 on; some that know the extension (1.3.239) do not
    // list it, and refuse it.
    if (direct
        && (result == VK_ERROR_EXTENSION_NOT_PRESENT || result == VK_ERROR_INCOMPATIBLE_DRIVER))
        return vkb_fail(
            error, VKB_ERROR_GENERAL,
            "validation of the bundled driver needs a Vulkan loader with "
            "VK_LUNARG_direct_driver_loading, which the system's lacks or refuses for "
            "this driver. Install a newer one, or set VKBLOOM_DRIVER=system to validate with "
            "the system's driver");
    if (result == VK_ERROR_INCOMPATIBLE_DRIVER) {
        vkb_fail(error, VKB_ERROR_ADAPTER_NOT_FOUND,
                 "no Vulkan adapter: the loader found no driver that works. %s", vkb_install_hint);
        error->result = result;
        snprintf(error->call, sizeof error->call, "vkCreateInstance");
        return false;
    }
    if (vkb_check(error, result, "vkCreateInstance"))
        return true;
    if (result == VK_ERROR_OUT_OF_HOST_MEMORY)
        vkb_add_words(error, ". If it is not, a driver's manifest (a JSON file) is damaged, which "
                             "some loaders report so; `vkbloom doctor` names the file");
    return false;
}

// Drivers keep the lowest version that was ever negotiated, and a loader opens a single driver
// (VK_LUNARG_direct_driver_loading, for validation) of version 7 alone.
enum { INTERFACE_VERSION = 7 };

typedef VkResult(VKAPI_PTR *negotiate_function)(uint32_t *version);

// The function that gives a driver's others, which is entered without the loader, by the interface
// that the loader uses; NULL on failure. The library stays open.
// Source: the Vulkan loader's documentation, LoaderDriverInterface.md.
static PFN_vkGetInstanceProcAddr open_driver(const char *path, struct vkb_error *error)
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

// Finds the functions that need no instance: those of the loader, or without validation those of
// the driver itself.
static bool open_source(struct vkb_instance *instance, PFN_vkGetInstanceProcAddr *driver,
                        struct vkb_error *error)
{
    *driver = NULL;
    if (instance->driver[0] && !(*driver = open_driver(instance->driver, error)))
        return false;
    if (*driver && !instance->validation) {
        instance->get = *driver;
        return true;
    }
    loader_open = loader_open || VK_RESULT(volkInitialize()) == VK_SUCCESS;
    if (!loader_open && *driver)
        return vkb_fail(error, VKB_ERROR_GENERAL,
                        "validation=True needs the system's Vulkan loader, also for the bundled "
                        "driver, and the loader (libvulkan.so.1) is missing. On Debian or Ubuntu: "
                        "apt install libvulkan1 vulkan-validationlayers");
    if (!loader_open)
        return vkb_fail(error, VKB_ERROR_ADAPTER_NOT_FOUND,
                        "no Vulkan adapter: the Vulkan loader (libvulkan.so.1) is missing. %s",
                        vkb_install_hint);
    if (vkEnumerateInstanceVersion == NULL)
        return vkb_fail(
            error, VKB_ERROR_ADAPTER_NOT_FOUND,
            "no Vulkan adapter: the Vulkan loader knows only Vulkan 1.0, 1.3 is needed. %s",
            vkb_install_hint);
    instance->get = vkGetInstanceProcAddr;
    return true;
}

// What an instance has where its source has it: surfaces. Those of a display server only where the
// variable names one: Mesa's layer for the selection of devices connects to it.
static const struct wish {
    const char *extension, *variable;
} wishes[] = {
    {VK_KHR_SURFACE_EXTENSION_NAME, NULL},
    {VK_EXT_HEADLESS_SURFACE_EXTENSION_NAME, NULL},
    {"VK_KHR_xcb_surface", "DISPLAY"},
    {"VK_KHR_xlib_surface", "DISPLAY"},
    {"VK_KHR_wayland_surface", "WAYLAND_DISPLAY"},
    {"VK_EXT_metal_surface", NULL},
    // Adapters that do less than Vulkan demands, such as MoltenVK's, are hidden without.
    {VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME, NULL},
    // Names are for RenderDoc, which sets this for its layer.
    {VK_EXT_DEBUG_UTILS_EXTENSION_NAME, "ENABLE_VULKAN_RENDERDOC_CAPTURE"},
};
enum {
    WISH_COUNT = sizeof wishes / sizeof wishes[0],
    MAX_EXTENSIONS = 128,
};

// Mesa without a window system lists VK_EXT_headless_surface, but not VK_KHR_surface, which it
// needs.
static bool lacks_surfaces(const struct vkb_instance *instance, const struct wish *wish)
{
    return wish > wishes && !instance->surfaces && strstr(wish->extension, "_surface");
}

// Adds to `names` those of the wished extensions that are there. Without a list there are none.
static void add_wished(struct vkb_instance *instance, PFN_vkGetInstanceProcAddr get,
                       const char **names, uint32_t *count)
{
    PFN_vkEnumerateInstanceExtensionProperties vkEnumerateInstanceExtensionProperties =
        (PFN_vkEnumerateInstanceExtensionProperties)get(VK_NULL_HANDLE,
                                                        "vkEnumerateInstanceExtensionProperties");
    VkExtensionProperties found[MAX_EXTENSIONS];
    uint32_t found_count = MAX_EXTENSIONS;

    if (!vkEnumerateInstanceExtensionProperties
        || VK_RESULT(vkEnumerateInstanceExtensionProperties(NULL, &found_count, found)) < 0)
        return;
    for (const struct wish *wish = wishes; wish < wishes + WISH_COUNT; ++wish)
        for (uint32_t i = 0; i < found_count; ++i)
            if (strcmp(found[i].extensionName, wish->extension) == 0
                && (!wish->variable || getenv(wish->variable)) && !lacks_surfaces(instance, wish)
                && !(*count > 0 && strcmp(names[0], wish->extension) == 0)) {
                names[(*count)++] = wish->extension;
                instance->surfaces |= wish == wishes;
                instance->portability |=
                    strcmp(wish->extension, VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME) == 0;
            }
}

// The messenger also receives the messages of the instance's creation.
static bool create_handle(struct vkb_instance *instance, PFN_vkGetInstanceProcAddr driver,
                          const VkDebugUtilsMessengerCreateInfoEXT *messenger,
                          struct vkb_error *error)
{
    PFN_vkCreateInstance vkCreateInstance =
        (PFN_vkCreateInstance)instance->get(VK_NULL_HANDLE, "vkCreateInstance");
    const VkDirectDriverLoadingListLUNARG direct = {
        .sType = VK_STRUCTURE_TYPE_DIRECT_DRIVER_LOADING_LIST_LUNARG,
        .pNext = (void *)messenger,
        .mode = VK_DIRECT_DRIVER_LOADING_MODE_EXCLUSIVE_LUNARG,
        .driverCount = 1,
        .pDrivers =
            &(VkDirectDriverLoadingInfoLUNARG){
                .sType = VK_STRUCTURE_TYPE_DIRECT_DRIVER_LOADING_INFO_LUNARG,
                .pfnGetInstanceProcAddr = (PFN_vkGetInstanceProcAddrLUNARG)driver,
            },
    };
    const VkValidationFeaturesEXT features = {
        .sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT,
        .pNext = driver ? (const void *)&direct : messenger,
        .enabledValidationFeatureCount = 1,
        .pEnabledValidationFeatures =
            (VkValidationFeatureEnableEXT[]){
                VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT},
    };

    const char *extensions[WISH_COUNT + 2];
    uint32_t extension_count = 0;
    if (messenger)
        extensions[extension_count++] = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
    if (messenger && driver)
        extensions[extension_count++] = VK_LUNARG_DIRECT_DRIVER_LOADING_EXTENSION_NAME;
    // Of a driver that the loader opens alone, those that this driver has.
    add_wished(instance, driver ? driver : instance->get, extensions, &extension_count);

    return check_created(
        VK_RESULT(vkCreateInstance(
            &(VkInstanceCreateInfo){
                .sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
                .pNext = messenger ? &features : NULL,
                .flags =
                    instance->portability ? VK_INSTANCE_CREATE_ENUMERATE_PORTABILITY_BIT_KHR : 0,
                .pApplicationInfo =
                    &(VkApplicationInfo){
                        .sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                        .pApplicationName = "vkbloom",
                        .apiVersion = VK_API_VERSION_1_3,
                    },
                .enabledLayerCount = messenger ? 1 : 0,
                .ppEnabledLayerNames = (const char *[]){VALIDATION_LAYER},
                .enabledExtensionCount = extension_count,
                .ppEnabledExtensionNames = extensions,
            },
            NULL, &instance->handle)),
        driver != NULL, error);
}

static void load_functions(struct vkb_instance *instance)
{
#define LOAD(name) instance->vk.name = (PFN_##name)instance->get(instance->handle, #name);
    VKB_INSTANCE_FUNCTIONS(LOAD)
#undef LOAD
}

static void destroy_instance(struct vkb_instance *instance)
{
    if (instance->messenger)
        instance->vk.vkDestroyDebugUtilsMessengerEXT(instance->handle, instance->messenger, NULL);
    if (instance->handle)
        instance->vk.vkDestroyInstance(instance->handle, NULL);
    instance->messenger = VK_NULL_HANDLE;
    instance->handle = VK_NULL_HANDLE;
}

static bool create_instance(struct vkb_instance *instance, const char *driver, bool validation,
                            struct vkb_error *error)
{
    PFN_vkGetInstanceProcAddr entry;

    const VkDebugUtilsMessengerCreateInfoEXT messenger = {
        .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
        .messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT
                         | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
        .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT,
        .pfnUserCallback = vkb_messages_receive,
    };

    *instance = (struct vkb_instance){
        .validation = validation,
        .process = vkb_current_process(),
    };
    if (strlen(driver) >= sizeof instance->driver)
        return vkb_fail(error, VKB_ERROR_GENERAL, "the driver's path is longer than %zu bytes",
                        sizeof instance->driver - 1);
    memcpy(instance->driver, driver, strlen(driver));
    instance->has_room = vkb_has_room(driver_mib(true));
    if ((instance->has_room || vkb_has_room(MIN_MIB)
         || vkb_fail_room("a Vulkan driver", driver_mib(true), error))
        && open_source(instance, &entry, error)
        && create_handle(instance, entry, validation ? &messenger : NULL, error)) {
        load_functions(instance);
        if (!validation
            || VK(error, instance->vk.vkCreateDebugUtilsMessengerEXT(instance->handle, &messenger,
                                                                     NULL, &instance->messenger)))
            return true;
    }
    destroy_instance(instance);
    return false;
}

// Finds an instance of this process; NULL: there is none. With the lock.
static struct vkb_instance *find_instance(const char *driver, bool validation, bool unclaimed)
{
    const long process = vkb_current_process();

    for (struct vkb_instance *instance = instances; instance; instance = instance->next) {
        forked |= instance->process != process;
        if (instance->process == process && instance->handle && instance->validation == validation
            && strcmp(instance->driver, driver) == 0 && !(unclaimed && instance->claimed))
            return instance;
    }
    return NULL;
}

// As find_instance, with one user more, who claims it if `unclaimed`.
static struct vkb_instance *take_instance(const char *driver, bool validation, bool unclaimed)
{
    vkb_lock_acquire(&lock);
    struct vkb_instance *instance = find_instance(driver, validation, unclaimed);
    if (instance) {
        ++instance->users;
        instance->claimed |= unclaimed;
    }
    vkb_lock_release(&lock);
    return instance;
}

// Gives an instance its place in the list: that of one that was destroyed, or a new one.
static struct vkb_instance *add_instance(const struct vkb_instance *made, struct vkb_error *error)
{
    struct vkb_instance *place;

    vkb_lock_acquire(&lock);
    for (place = instances; place; place = place->next)
        if (place->process == made->process && !place->handle)
            break;
    if (!place && (place = vkb_alloc(error, 1, sizeof *place))) {
        place->next = instances;
        instances = place;
    }
    if (place) {
        struct vkb_instance *next = place->next;
        *place = *made;
        place->next = next;
    }
    vkb_lock_release(&lock);
    return place;
}

// Finds or creates an instance of this process for one user more.
static struct vkb_instance *use_instance(const char *driver, bool validation, bool unclaimed,
                                         struct vkb_error *error)
{
    struct vkb_instance made, *instance = take_instance(driver, validation, unclaimed);

    if (instance)
        return instance;
    vkb_lock_acquire(&creation);
    // Another thread may have created it meanwhile.
    instance = take_instance(driver, validation, unclaimed);
    if (!instance && create_instance(&made, driver, validation, error)) {
        made.users = 1;
        made.claimed = unclaimed;
        instance = add_instance(&made, error);
        if (!instance)
            destroy_instance(&made);
    }
    vkb_lock_release(&creation);
    return instance;
}

struct vkb_instance *vkb_instance_open(const char *driver, bool validation, struct vkb_error *error)
{
    return use_instance(driver, validation, false, error);
}

static void leave_instance(struct vkb_instance *instance)
{
    struct vkb_instance left = {0};

    vkb_lock_acquire(&lock);
    instance->claimed = --instance->users > 0 && instance->claimed;
    if (instance->users == 0 && forked) {
        left = *instance;
        instance->messenger = VK_NULL_HANDLE;
        instance->handle = VK_NULL_HANDLE;
    }
    vkb_lock_release(&lock);
    destroy_instance(&left);
}

bool vkb_instance_claim(struct vkb_instance **instance, struct vkb_error *error)
{
    struct vkb_instance *shared = *instance;

    vkb_lock_acquire(&lock);
    const bool first = !shared->claimed;
    shared->claimed = true;
    vkb_lock_release(&lock);
    if (first)
        return true;
    struct vkb_instance *own = use_instance(shared->driver, shared->validation, true, error);
    if (own) {
        leave_instance(shared);
        *instance = own;
    }
    return own != NULL;
}

void vkb_instance_close(struct vkb_instance *instance)
{
    leave_instance(instance);
}

// Takes the handle of an instance of this process without users; false: there is none.
static bool take_unused(struct vkb_instance *unused)
{
    const long process = vkb_current_process();
    bool found = false;

    vkb_lock_acquire(&lock);
    for (struct vkb_instance *instance = instances; instance && !found; instance = instance->next)
        if (instance->process == process && instance->handle && instance->users == 0) {
            *unused = *instance;
            instance->messenger = VK_NULL_HANDLE;
            instance->handle = VK_NULL_HANDLE;
            found = true;
        }
    vkb_lock_release(&lock);
    return found;
}

void vkb_instances_end(void)
{
    struct vkb_instance unused;

    vkb_lock_acquire(&creation);
    while (take_unused(&unused))
        destroy_instance(&unused);
    vkb_lock_release(&creation);
}

bool vkb_instance_require_room(const struct vkb_instance *instance, bool lavapipe,
                               struct vkb_error *error)
{
    return instance->has_room || vkb_require_room("a Vulkan driver", driver_mib(lavapipe), error);
}

void vkb_instance_explain(struct vkb_error *error)
{
    size_t users = 0;

    vkb_lock_acquire(&lock);
    for (const struct vkb_instance *instance = instances; instance; instance = instance->next)
        users += instance->process == vkb_current_process() ? instance->users : 0;
    if (strcmp(error->call, "vkCreateDevice") == 0)
        vkb_add_words(error,
                      ". Renderers open in this process: %zu. Drivers limit their number (NVIDIA's "
                      "to fewer than 100): close those that are not needed",
                      users);
    if (forked)
        vkb_add_words(error,
                      ". This process was forked from one that had used Vulkan, after which some "
                      "drivers (NVIDIA's among them) do not work; start it by multiprocessing's "
                      "method \"spawn\" or \"forkserver\"");
    vkb_lock_release(&lock);
}

void vkb_instance_load_device(const struct vkb_instance *instance, VkDevice device,
                              struct VolkDeviceTable *table)
{
    vkb_lock_acquire(&lock);
    // volk loads the table through its global function pointer.
    vkGetDeviceProcAddr = instance->vk.vkGetDeviceProcAddr;
    volkLoadDeviceTable(table, device);
    vkb_lock_release(&lock);
}

#ifdef VKBLOOM_FAULTS
void vkb_fault_forget_instances(void)
{
    vkb_lock_acquire(&creation);
    while (instances) {
        struct vkb_instance *instance = instances;
        instances = instance->next;
        destroy_instance(instance);
        vkb_free(instance);
    }
    loader_open = false;
    vkb_lock_release(&creation);
}
#endif
