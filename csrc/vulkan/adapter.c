#include "vulkan/adapter.h"

#include <ctype.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <volk.h>

#define VALIDATION_LAYER "VK_LAYER_KHRONOS_validation"

static const char INSTALL_HINT[] =
    "On Debian or Ubuntu: apt install libvulkan1 mesa-vulkan-drivers (lavapipe, runs on any CPU); "
    "for a GPU, install its vendor's Vulkan driver. `vkbloom doctor` tells more.";

const char *vkb_adapter_type(const struct vkb_adapter_info *adapter)
{
    switch (adapter->device_type) {
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
        return "cpu";
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
        return "integrated";
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
        return "discrete";
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
        return "virtual";
    default:
        return "other";
    }
}

// volk keeps the loader's entry points in globals. They are written once, under this lock: those of
// the core functions dispatch by their handle, so every instance can share them.
static atomic_flag loader_lock = ATOMIC_FLAG_INIT;
static bool loader_open, functions_loaded;

static void lock_loader(void)
{
    while (atomic_flag_test_and_set(&loader_lock))
        ;
}

static void unlock_loader(void)
{
    atomic_flag_clear(&loader_lock);
}

static bool open_loader(struct vkb_error *error)
{
    lock_loader();
    if (!loader_open)
        loader_open = VK_RESULT(volkInitialize()) == VK_SUCCESS;
    bool open = loader_open;
    unlock_loader();
    if (!open)
        return vkb_fail(error, VKB_ERROR_ADAPTER_NOT_FOUND,
                        "no Vulkan adapter: the Vulkan loader (libvulkan.so.1) is missing. %s",
                        INSTALL_HINT);
    return true;
}

static void load_functions(VkInstance instance)
{
    lock_loader();
    if (!functions_loaded)
        volkLoadInstanceOnly(instance);
    functions_loaded = true;
    unlock_loader();
}

static VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                                 VkDebugUtilsMessageTypeFlagsEXT types,
                                                 const VkDebugUtilsMessengerCallbackDataEXT *data,
                                                 void *user_data)
{
    struct vkb_instance *instance = user_data;

    (void)severity;
    (void)types;
#ifdef VKBLOOM_FAULTS
    vkb_fault_message();
#endif
    if (instance->message_count++ == 0)
        snprintf(instance->first_message, sizeof instance->first_message, "%s", data->pMessage);
    return VK_FALSE;
}

static bool validation_available(void)
{
    VkLayerProperties layers[128];
    uint32_t count = sizeof layers / sizeof layers[0];
    VkResult result = VK_RESULT(vkEnumerateInstanceLayerProperties(&count, layers));

    if (result != VK_SUCCESS && result != VK_INCOMPLETE)
        return false;
    for (uint32_t i = 0; i < count; ++i)
        if (strcmp(layers[i].layerName, VALIDATION_LAYER) == 0)
            return true;
    return false;
}

static bool check_loader(bool validation, struct vkb_error *error)
{
    if (!open_loader(error))
        return false;
    if (vkEnumerateInstanceVersion == NULL)
        return vkb_fail(
            error, VKB_ERROR_ADAPTER_NOT_FOUND,
            "no Vulkan adapter: the Vulkan loader knows only Vulkan 1.0, 1.1 is needed. %s",
            INSTALL_HINT);
    if (validation && !validation_available())
        return vkb_fail(error, VKB_ERROR_GENERAL,
                        "validation was asked for, but %s is not installed. "
                        "On Debian or Ubuntu: apt install vulkan-validationlayers",
                        VALIDATION_LAYER);
    return true;
}

// The messenger hears what the instance's own creation and end lead to as well.
static bool create_handle(struct vkb_instance *instance,
                          const VkDebugUtilsMessengerCreateInfoEXT *messenger,
                          struct vkb_error *error)
{
    const bool validation = instance->validation;
    VkValidationFeaturesEXT features = {
        .sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT,
        .pNext = messenger,
        .enabledValidationFeatureCount = 1,
        .pEnabledValidationFeatures =
            (VkValidationFeatureEnableEXT[]){
                VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT},
    };
    VkResult result = VK_RESULT(vkCreateInstance(
        &(VkInstanceCreateInfo){
            .sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
            .pNext = validation ? &features : NULL,
            .pApplicationInfo =
                &(VkApplicationInfo){
                    .sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                    .pApplicationName = "vkbloom",
                    .apiVersion = VK_API_VERSION_1_1,
                },
            .enabledLayerCount = validation ? 1 : 0,
            .ppEnabledLayerNames = (const char *[]){VALIDATION_LAYER},
            .enabledExtensionCount = validation ? 1 : 0,
            .ppEnabledExtensionNames = (const char *[]){VK_EXT_DEBUG_UTILS_EXTENSION_NAME},
        },
        NULL, &instance->handle));
    if (result == VK_ERROR_INCOMPATIBLE_DRIVER) {
        vkb_fail(error, VKB_ERROR_ADAPTER_NOT_FOUND,
                 "no Vulkan adapter: the loader found no driver that works. %s", INSTALL_HINT);
        error->result = result;
        snprintf(error->call, sizeof error->call, "vkCreateInstance");
        return false;
    }
    return vkb_check(error, result, "vkCreateInstance");
}

bool vkb_instance_create(struct vkb_instance *instance, bool validation, struct vkb_error *error)
{
    const VkDebugUtilsMessengerCreateInfoEXT messenger = {
        .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
        .messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT
                         | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
        .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT,
        .pfnUserCallback = on_message,
        .pUserData = instance,
    };

    *instance = (struct vkb_instance){.validation = validation};
    if (!check_loader(validation, error) || !create_handle(instance, &messenger, error))
        return false;
    load_functions(instance->handle);
    if (!validation)
        return true;

    // Taken per instance, as below, and named as errors are to name it: it hides volk's global.
    PFN_vkCreateDebugUtilsMessengerEXT vkCreateDebugUtilsMessengerEXT =
        (PFN_vkCreateDebugUtilsMessengerEXT)vkGetInstanceProcAddr(instance->handle,
                                                                  "vkCreateDebugUtilsMessengerEXT");
    if (VK(error, vkCreateDebugUtilsMessengerEXT(instance->handle, &messenger, NULL,
                                                 &instance->messenger)))
        return true;
    vkb_instance_destroy(instance);
    return false;
}

void vkb_instance_destroy(struct vkb_instance *instance)
{
    if (instance->messenger) {
        // Taken per instance: volk's global pointer would be the first instance's, or none.
        PFN_vkDestroyDebugUtilsMessengerEXT destroy_messenger =
            (PFN_vkDestroyDebugUtilsMessengerEXT)vkGetInstanceProcAddr(
                instance->handle, "vkDestroyDebugUtilsMessengerEXT");
        destroy_messenger(instance->handle, instance->messenger, NULL);
    }
    if (instance->handle)
        vkDestroyInstance(instance->handle, NULL);
    instance->messenger = VK_NULL_HANDLE;
    instance->handle = VK_NULL_HANDLE;
}

bool vkb_instance_check(struct vkb_instance *instance, struct vkb_error *error)
{
    if (instance->message_count == 0)
        return true;
    vkb_fail(error, VKB_ERROR_VALIDATION, "%s (%u validation messages in this call)",
             instance->first_message, instance->message_count);
    instance->message_count = 0;
    return false;
}

// A queue family that draws, computes and so can copy as well; UINT32_MAX where there is none.
static uint32_t find_queue_family(VkPhysicalDevice physical)
{
    VkQueueFamilyProperties families[16];
    uint32_t count = sizeof families / sizeof families[0];
    const VkQueueFlags needed = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;

    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families);
    for (uint32_t i = 0; i < count; ++i)
        if ((families[i].queueFlags & needed) == needed)
            return i;
    return UINT32_MAX;
}

static bool describe(VkPhysicalDevice physical, struct vkb_adapter_info *adapter)
{
    VkPhysicalDeviceDriverProperties driver = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES,
    };
    VkPhysicalDeviceIDProperties id = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES,
    };
    VkPhysicalDeviceProperties2 properties = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2,
        .pNext = &id,
    };
    VkPhysicalDeviceProperties plain;

    vkGetPhysicalDeviceProperties(physical, &plain);
    if (plain.apiVersion < VK_API_VERSION_1_1)
        return false;
    // The driver's name is core from 1.2 on only.
    if (plain.apiVersion >= VK_API_VERSION_1_2)
        id.pNext = &driver;
    vkGetPhysicalDeviceProperties2(physical, &properties);

    *adapter = (struct vkb_adapter_info){
        .physical = physical,
        .device_type = plain.deviceType,
        .api_version = plain.apiVersion,
        .driver_version = plain.driverVersion,
        .queue_family = find_queue_family(physical),
    };
    memcpy(adapter->name, plain.deviceName, sizeof adapter->name);
    memcpy(adapter->driver, driver.driverName, sizeof adapter->driver);
    memcpy(adapter->driver_info, driver.driverInfo, sizeof adapter->driver_info);
    memcpy(adapter->driver_uuid, id.driverUUID, sizeof adapter->driver_uuid);
    return adapter->queue_family != UINT32_MAX;
}

bool vkb_adapters_list(const struct vkb_instance *instance, struct vkb_adapter_info *adapters,
                       uint32_t *count, struct vkb_error *error)
{
    VkPhysicalDevice devices[VKB_MAX_ADAPTERS];
    uint32_t device_count = VKB_MAX_ADAPTERS;
    VkResult result =
        VK_RESULT(vkEnumeratePhysicalDevices(instance->handle, &device_count, devices));

    *count = 0;
    // Some loaders answer so where they have no driver at all.
    if (result == VK_ERROR_INITIALIZATION_FAILED)
        return true;
    if (result != VK_INCOMPLETE && !vkb_check(error, result, "vkEnumeratePhysicalDevices"))
        return false;
    for (uint32_t i = 0; i < device_count; ++i)
        *count += describe(devices[i], &adapters[*count]);
    return true;
}

// Lower is better; the order of "auto".
static int preference(const struct vkb_adapter_info *adapter)
{
    switch (adapter->device_type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
        return 0;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
        return 1;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
        return 2;
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
        return 3;
    default:
        return 4;
    }
}

static bool contains(const char *text, const char *part)
{
    for (; *text; ++text) {
        size_t i = 0;
        while (part[i] && tolower((unsigned char)text[i]) == tolower((unsigned char)part[i]))
            ++i;
        if (!part[i])
            return true;
    }
    return false;
}

static bool fits(const struct vkb_adapter_info *adapter, const char *choice)
{
    bool cpu = adapter->device_type == VK_PHYSICAL_DEVICE_TYPE_CPU;

    if (strcmp(choice, "auto") == 0)
        return true;
    if (strcmp(choice, "software") == 0)
        return cpu;
    if (strcmp(choice, "hardware") == 0)
        return !cpu;
    return contains(adapter->name, choice);
}

bool vkb_adapter_choose(const struct vkb_instance *instance, const char *choice,
                        struct vkb_adapter_info *chosen, struct vkb_error *error)
{
    struct vkb_adapter_info adapters[VKB_MAX_ADAPTERS];
    uint32_t count;
    const struct vkb_adapter_info *best = NULL;

    if (!vkb_adapters_list(instance, adapters, &count, error))
        return false;
    for (uint32_t i = 0; i < count; ++i)
        if (fits(&adapters[i], choice) && (!best || preference(&adapters[i]) < preference(best)))
            best = &adapters[i];
    if (best) {
        *chosen = *best;
        return true;
    }

    char found[1024] = "none";
    size_t length = 0;
    for (uint32_t i = 0; i < count && length < sizeof found; ++i)
        length += (size_t)snprintf(found + length, sizeof found - length, "%s%s (%s)",
                                   i ? ", " : "", adapters[i].name, vkb_adapter_type(&adapters[i]));
    return vkb_fail(error, VKB_ERROR_ADAPTER_NOT_FOUND,
                    "no Vulkan adapter for \"%s\"; found: %s. %s", choice, found, INSTALL_HINT);
}
