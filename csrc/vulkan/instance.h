// The Vulkan instances: of the system's loader and of a driver that is opened without the loader,
// each with and without the validation layer. Each is created at first use and kept for the life of
// the process, for the next device. Some drivers limit how many instances a process can create one
// after the other (NVIDIA's 580: about 30), and lavapipe leaks memory with each.
#ifndef VKB_INSTANCE_H
#define VKB_INSTANCE_H

#include "vulkan/error.h"

#include <volk.h>

// A hint for errors: what to install if no adapter is found.
extern const char vkb_install_hint[];

// The instance functions that the core calls. Each instance has its own table, as each device has,
// since two instances may come from different loaders. Those of an extension that the instance does
// not have are NULL.
#define VKB_INSTANCE_FUNCTIONS(NAME) \
    NAME(vkCreateDevice) \
    NAME(vkDestroyInstance) \
    NAME(vkEnumerateDeviceExtensionProperties) \
    NAME(vkEnumeratePhysicalDevices) \
    NAME(vkGetDeviceProcAddr) \
    NAME(vkGetPhysicalDeviceExternalBufferProperties) \
    NAME(vkGetPhysicalDeviceExternalSemaphoreProperties) \
    NAME(vkGetPhysicalDeviceFeatures2) \
    NAME(vkGetPhysicalDeviceFormatProperties) \
    NAME(vkGetPhysicalDeviceImageFormatProperties) \
    NAME(vkGetPhysicalDeviceImageFormatProperties2) \
    NAME(vkGetPhysicalDeviceMemoryProperties) \
    NAME(vkGetPhysicalDeviceProperties) \
    NAME(vkGetPhysicalDeviceProperties2) \
    NAME(vkGetPhysicalDeviceQueueFamilyProperties) \
    NAME(vkGetPhysicalDeviceSurfaceCapabilitiesKHR) \
    NAME(vkGetPhysicalDeviceSurfaceFormatsKHR) \
    NAME(vkGetPhysicalDeviceSurfaceSupportKHR) \
    NAME(vkCreateHeadlessSurfaceEXT) \
    NAME(vkDestroySurfaceKHR) \
    NAME(vkCreateDebugUtilsMessengerEXT) \
    NAME(vkCmdBeginDebugUtilsLabelEXT) \
    NAME(vkCmdEndDebugUtilsLabelEXT) \
    NAME(vkSetDebugUtilsObjectNameEXT) \
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
    bool has_room;     // at its creation there was address space for lavapipe
    bool portability;  // adapters that do less than Vulkan demands are not hidden
    bool surfaces;     // it has VK_KHR_surface, and those of the windows and screens that there are
    PFN_vkGetInstanceProcAddr get;  // of the loader, or of the driver
    struct vkb_instance_table vk;
    VkDebugUtilsMessengerEXT messenger;  // with validation: vkb_messages_receive
    long process;                        // the process that created it
    size_t users;
    bool claimed;  // by a device
    struct vkb_instance *next;
};

// Returns this process's instance; any thread may call it. NULL on failure; the next call tries
// again. With a `driver` other than "", the library at that path is opened without a loader; only
// validation needs one, because a layer is inserted by the loader. Otherwise the Vulkan loader is
// opened at run time. An ADAPTER_NOT_FOUND error says what to install. A forked process creates its
// own instance, if the driver can, and does not touch its parent's. It destroys its own instance
// when the last user closes it.
struct vkb_instance *vkb_instance_open(const char *driver, bool validation,
                                       struct vkb_error *error);
void vkb_instance_close(struct vkb_instance *instance);

// Destroys those of this process that have no user, before the process exits. Mesa writes its cache
// of shaders in threads, which end at exit with what they have not written yet, unless the instance
// is destroyed before.
void vkb_instances_end(void);

// Replaces the instance by one that no other device has claimed, as a device of lavapipe does. The
// devices of an instance share one llvmpipe, which looks for the users of an image in the scenes of
// all of them, while their threads free these: 16 threads with a device each ended the process 3
// times in 7 (Mesa 22.3.6 with a checking allocator, tests/core/all_calls.py, 2026-11-27; never in
// 11 runs with an instance each). The adapters of the new instance have to be listed again.
bool vkb_instance_claim(struct vkb_instance **instance, struct vkb_error *error);

// Checks that there is address space for the driver of a CPU, lavapipe or another, which creates
// its threads with a device.
bool vkb_instance_require_room(const struct vkb_instance *instance, bool lavapipe,
                               struct vkb_error *error);

// Adds probable causes and remedies to an error of opening something: too many renderers, or a fork
// from a process with an instance.
void vkb_instance_explain(struct vkb_error *error);

// Loads the functions of a device of this instance.
void vkb_instance_load_device(const struct vkb_instance *instance, VkDevice device,
                              struct VolkDeviceTable *table);

#endif
