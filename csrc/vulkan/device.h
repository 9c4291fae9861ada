// A logical device with one queue, and how work is handed to it.
#ifndef VKB_DEVICE_H
#define VKB_DEVICE_H

#include "vulkan/adapter.h"
#include "vulkan/format.h"
#include "vulkan/messages.h"

#include <stdatomic.h>

struct vkb_device {
    struct vkb_instance *instance;
    struct vkb_messages messages;  // stay readable after the device's end
    struct vkb_adapter_info adapter;
    VkDevice handle;
    struct VolkDeviceTable vk;
    VkQueue queue;
    VkPhysicalDeviceMemoryProperties memory;
    VkPhysicalDeviceLimits limits;
    uint32_t max_side;                                // of an image that passes write
    VkFormatFeatureFlags features[VKB_FORMAT_COUNT];  // of images with optimal tiling
    bool dispatch;            // compute shaders can write images of every format
    uint64_t timestamp_mask;  // 0: the queue has no timestamps
    // Host memory that becomes a buffer starts and ends at multiples of it; 0: none can.
    VkDeviceSize import_alignment;
    atomic_bool lost;  // others look at it while the device is used
    bool hung;         // lost because a wait took too long: it may be at work still
    // Asked between the slices of a long wait; true ends it. NULL: nobody is.
    bool (*interrupted)(void *asked);
    void *asked;
    double frame_seconds;  // how long a wait may take for each frame that is waited for
};

// `device` must not move in memory while it lives, as the messages in it. Whoever calls Vulkan with
// it is between vkb_messages_begin(&device->messages) and vkb_messages_end; these two do so
// themselves.
bool vkb_device_create(struct vkb_device *device, const char *adapter_choice, const char *driver,
                       bool validation, struct vkb_error *error);
void vkb_device_destroy(struct vkb_device *device);

// Whether images of `format` can be used in all the ways of `features` with optimal tiling.
bool vkb_device_supports(const struct vkb_device *device, enum vkb_format format,
                         VkFormatFeatureFlags features);

// Whether images of that kind are best in memory that the host can write to: on a CPU, where all
// memory is the host's and no tiling is faster than rows.
bool vkb_device_shares_image(const struct vkb_device *device, VkFormat format,
                             VkImageUsageFlags usage, VkFormatFeatureFlags features, uint32_t width,
                             uint32_t height);

// Submits the recorded commands; `fence`, unsignalled before, is signalled when the device has run
// them and all that was submitted before. A lost device is remembered.
bool vkb_device_submit(struct vkb_device *device, VkCommandBuffer commands, VkFence fence,
                       struct vkb_error *error);
// Waits for the fence and leaves it unsignalled. A device that takes longer than `frames` frames
// may counts as lost; a lost device is remembered. On failure it may be at work still.
bool vkb_device_wait(struct vkb_device *device, VkFence fence, uint32_t frames,
                     struct vkb_error *error);

#endif
