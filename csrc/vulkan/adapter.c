#include "vulkan/adapter.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

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

// A queue family with graphics and compute, which implies transfer; UINT32_MAX if there is none.
static uint32_t find_queue_family(const struct vkb_instance *instance, VkPhysicalDevice physical)
{
    VkQueueFamilyProperties families[16];
    uint32_t count = sizeof families / sizeof families[0];
    const VkQueueFlags needed = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;

    instance->vk.vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families);
    for (uint32_t i = 0; i < count; ++i)
        if ((families[i].queueFlags & needed) == needed)
            return i;
    return UINT32_MAX;
}

static bool describe(const struct vkb_instance *instance, VkPhysicalDevice physical,
                     struct vkb_adapter_info *adapter)
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

    instance->vk.vkGetPhysicalDeviceProperties(physical, &plain);
    if (plain.apiVersion < VK_API_VERSION_1_1)
        return false;
    // Driver properties are core since Vulkan 1.2.
    if (plain.apiVersion >= VK_API_VERSION_1_2)
        id.pNext = &driver;
    instance->vk.vkGetPhysicalDeviceProperties2(physical, &properties);

    *adapter = (struct vkb_adapter_info){
        .physical = physical,
        .device_type = plain.deviceType,
        .api_version = plain.apiVersion,
        .driver_version = plain.driverVersion,
        .queue_family = find_queue_family(instance, physical),
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
    VkResult result = VK_RESULT(
        instance->vk.vkEnumeratePhysicalDevices(instance->handle, &device_count, devices));

    *count = 0;
    // Some loaders return this if they have no driver.
    if (result == VK_ERROR_INITIALIZATION_FAILED)
        return true;
    if (result != VK_INCOMPLETE && !vkb_check(error, result, "vkEnumeratePhysicalDevices"))
        return false;
    for (uint32_t i = 0; i < device_count; ++i)
        *count += describe(instance, devices[i], &adapters[*count]);
    return true;
}

// The rank of an adapter for "auto"; lower is better.
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
                    "no Vulkan adapter for \"%s\"; found: %s. %s", choice, found, vkb_install_hint);
}
