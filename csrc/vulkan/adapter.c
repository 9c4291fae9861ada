#include "vulkan/adapter.h"

#include <stdio.h>
#include <string.h>

const char *vkb_adapter_type(const struct vkb_adapter_info *adapter)
{
    static const char *const types[] = {
        [VK_PHYSICAL_DEVICE_TYPE_OTHER] = "other",
        [VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU] = "integrated",
        [VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU] = "discrete",
        [VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU] = "virtual",
        [VK_PHYSICAL_DEVICE_TYPE_CPU] = "cpu",
    };
    const size_t type = (size_t)adapter->device_type;

    return types[type < sizeof types / sizeof types[0] ? type : 0];
}

// Finds a queue family with graphics and compute, which implies transfer.
static bool find_queue_family(const struct vkb_instance *instance, struct vkb_adapter_info *adapter)
{
    VkQueueFamilyProperties families[16];
    uint32_t count = sizeof families / sizeof families[0], i = 0;
    const VkQueueFlags needed = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;

    instance->vk.vkGetPhysicalDeviceQueueFamilyProperties(adapter->physical, &count, families);
    while (i < count && (families[i].queueFlags & needed) != needed)
        ++i;
    if (i == count)
        return false;
    const uint32_t bits = families[i].timestampValidBits;
    adapter->queue_family = i;
    adapter->timestamp_mask = bits >= 64 ? UINT64_MAX : (UINT64_C(1) << bits) - 1;
    return true;
}

void vkb_uuid_text(const uint8_t uuid[VK_UUID_SIZE], char text[VKB_UUID_TEXT_SIZE])
{
    for (uint32_t i = 0; i < VK_UUID_SIZE; ++i)
        text += sprintf(text, "%s%02x", i >= 4 && i <= 10 && i % 2 == 0 ? "-" : "", uuid[i]);
}

bool vkb_find_extensions(const struct vkb_instance *instance, VkPhysicalDevice physical,
                         const char *const *names, uint32_t name_count, bool *found,
                         struct vkb_error *error)
{
    const struct vkb_instance_table *vk = &instance->vk;
    VkExtensionProperties *extensions;
    uint32_t count = 0;

    memset(found, 0, name_count * sizeof *found);
    if (!VK(error, vk->vkEnumerateDeviceExtensionProperties(physical, NULL, &count, NULL))
        || !(extensions = vkb_alloc(error, count, sizeof *extensions)))
        return false;
    const bool done =
        VK(error, vk->vkEnumerateDeviceExtensionProperties(physical, NULL, &count, extensions));
    for (uint32_t i = 0; done && i < count; ++i)
        for (uint32_t name = 0; name < name_count; ++name)
            found[name] |= strcmp(extensions[i].extensionName, names[name]) == 0;
    vkb_free(extensions);
    return done;
}

// Leaves the address empty where it is unknown, or the query fails.
static void read_pci(const struct vkb_instance *instance, struct vkb_adapter_info *adapter)
{
    VkPhysicalDevicePCIBusInfoPropertiesEXT pci = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PCI_BUS_INFO_PROPERTIES_EXT,
    };
    VkPhysicalDeviceProperties2 properties = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2,
        .pNext = &pci,
    };
    struct vkb_error error = {0};
    bool found;

    if (!vkb_find_extensions(instance, adapter->physical,
                             &(const char *){VK_EXT_PCI_BUS_INFO_EXTENSION_NAME}, 1, &found, &error)
        || !found)
        return;
    instance->vk.vkGetPhysicalDeviceProperties2(adapter->physical, &properties);
    snprintf(adapter->pci, sizeof adapter->pci, "%04x:%02x:%02x.%x", pci.pciDomain, pci.pciBus,
             pci.pciDevice, pci.pciFunction);
}

// Whether the adapter can run vkbloom.
static bool describe(const struct vkb_instance *instance, VkPhysicalDevice physical,
                     struct vkb_adapter_info *adapter)
{
    VkPhysicalDeviceDriverProperties driver = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES,
    };
    VkPhysicalDeviceIDProperties id = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES,
        .pNext = &driver,
    };
    VkPhysicalDeviceProperties2 properties = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2,
        .pNext = &id,
    };
    VkPhysicalDeviceProperties plain;

    instance->vk.vkGetPhysicalDeviceProperties(physical, &plain);
    if (plain.apiVersion < VK_API_VERSION_1_3)
        return false;
    instance->vk.vkGetPhysicalDeviceProperties2(physical, &properties);

    *adapter = (struct vkb_adapter_info){
        .physical = physical,
        .device_type = plain.deviceType,
        .driver_id = driver.driverID,
        .nonconformant = driver.conformanceVersion.major == 0,
        .api_version = plain.apiVersion,
        .vendor = plain.vendorID,
        .bundled = instance->driver[0] != 0,
    };
    memcpy(adapter->name, plain.deviceName, sizeof adapter->name);
    memcpy(adapter->driver, driver.driverName, sizeof adapter->driver);
    memcpy(adapter->driver_info, driver.driverInfo, sizeof adapter->driver_info);
    memcpy(adapter->driver_uuid, id.driverUUID, sizeof adapter->driver_uuid);
    memcpy(adapter->uuid, id.deviceUUID, sizeof adapter->uuid);
    read_pci(instance, adapter);
    return find_queue_family(instance, adapter);
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
