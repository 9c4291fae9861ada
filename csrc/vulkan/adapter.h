// The adapters of an instance, and the selection of one.
#ifndef VKB_ADAPTER_H
#define VKB_ADAPTER_H

#include "vulkan/instance.h"

#include <stdint.h>

enum {
    VKB_PCI_SIZE = 24,
    VKB_UUID_TEXT_SIZE = 37,
};

struct vkb_adapter_info {
    VkPhysicalDevice physical;
    char name[VK_MAX_PHYSICAL_DEVICE_NAME_SIZE];
    VkPhysicalDeviceType device_type;
    char driver[VK_MAX_DRIVER_NAME_SIZE];
    char driver_info[VK_MAX_DRIVER_INFO_SIZE];
    VkDriverId driver_id;
    bool nonconformant;  // the driver says so
    uint32_t api_version;
    uint8_t driver_uuid[VK_UUID_SIZE];
    uint8_t uuid[VK_UUID_SIZE];  // of the device
    uint32_t vendor;
    char pci[VKB_PCI_SIZE];   // "0000:3b:00.0"; "": unknown
    uint32_t queue_family;    // one with graphics and compute
    uint64_t timestamp_mask;  // 0: the queue has no timestamps
    bool bundled;             // of a driver that the loader did not find
};

enum { VKB_MAX_ADAPTERS = 32 };

// "cpu", "integrated", "discrete", "virtual" or "other".
const char *vkb_adapter_type(const struct vkb_adapter_info *adapter);

// The text of a UUID, in five groups of hexadecimal digits.
void vkb_uuid_text(const uint8_t uuid[VK_UUID_SIZE], char text[VKB_UUID_TEXT_SIZE]);

// Whether the device has each of the named extensions.
bool vkb_find_extensions(const struct vkb_instance *instance, VkPhysicalDevice physical,
                         const char *const *names, uint32_t name_count, bool *found,
                         struct vkb_error *error);

// The adapters that can run vkbloom, in the system's order.
bool vkb_adapters_list(const struct vkb_instance *instance, struct vkb_adapter_info *adapters,
                       uint32_t *count, struct vkb_error *error);

#endif
