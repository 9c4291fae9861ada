// The Vulkan instances: of the system's loader and of a driver that is opened without it, one with
// the validation layer and one without, each made on first use and kept for the life of the
// process. Some drivers allow a process few instances in a row (NVIDIA's 580 about 30), and
// lavapipe loses memory with each.
#ifndef VKB_INSTANCE_H
#define VKB_INSTANCE_H

#include "vulkan/error.h"

#include <volk.h>

// What to install where no adapter is found.
extern const char vkb_install_hint[];

// The functions of an instance that the core calls. Each instance has its own, as each device has:
// two of them need not be of the same loader.
#define VKB_INSTANCE_FUNCTIONS(NAME) \
    NAME(vkCreateDevice) \
    NAME(vkDestroyInstance) \
    NAME(vkEnumerateDeviceExtensionProperties) \
    NAME(vkEnumeratePhysicalDevices) \
    NAME(vkGetDeviceProcAddr) \
    NAME(vkGetPhysicalDeviceExternalBufferProperties) \
    NAME(vkGetPhysicalDeviceFeatures) \
    NAME(vkGetPhysicalDeviceFormatProperties) \
    NAME(vkGetPhysicalDeviceImageFormatProperties) \
    NAME(vkGetPhysicalDeviceMemoryProperties) \
    NAME(vkGetPhysicalDeviceProperties) \
    NAME(vkGetPhysicalDeviceProperties2) \
    NAME(vkGetPhysicalDeviceQueueFamilyProperties) \
    NAME(vkCreateDebugUtilsMessengerEXT) \
    NAME(vkDestroyDebugUtilsMessengerEXT)

struct vkb_instance_table {
#define VKB_MEMBER(name) PFN_##name name;
    VKB_INSTANCE_FUNCTIONS(VKB_MEMBER)
#undef VKB_MEMBER
};

struct vkb_instance {
    VkInstance handle;
    char driver[4096];  // the path of its library; "": those that the system's loader finds
    bool validation;
    PFN_vkGetInstanceProcAddr get;  // of the loader, or of the driver
    struct vkb_instance_table vk;
    VkDebugUtilsMessengerEXT messenger;  // with validation: vkb_messages_receive
    long process;                        // that made it
    size_t users;
};

// This process's instance, from any thread; NULL on failure, after which the next call tries again.
// With a `driver` other than "", that one alone: its library is entered as the loader would, and no
// loader is needed, but for validation, whose layer only a loader puts between. Without, opens the
// Vulkan loader at run time; ADAPTER_NOT_FOUND says what to install. A forked process
// makes its own, where the driver can, and leaves its parent's as it is; that own one it does not
// keep when the last user closes it.
struct vkb_instance *vkb_instance_open(const char *driver, bool validation,
                                       struct vkb_error *error);
void vkb_instance_close(struct vkb_instance *instance);

// Adds to an error what may have led to it where this process was forked from one with an instance,
// and what to do.
void vkb_instance_explain_fork(struct vkb_error *error);

// The functions of a device of that instance.
void vkb_instance_load_device(const struct vkb_instance *instance, VkDevice device,
                              struct VolkDeviceTable *table);

#endif
