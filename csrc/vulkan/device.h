// A logical device with one queue; submission and waiting.
#ifndef VKB_DEVICE_H
#define VKB_DEVICE_H

#include "vulkan/adapter.h"
#include "vulkan/format.h"
#include "vulkan/messages.h"
#include "vulkan/parts.h"

#include <stdatomic.h>

// The float of an 8-bit level, as a shader reads it: the nearest to level / 255; the product with
// the float nearest to 1 / 255. Other ones, or half floats that are not theirs, have no fused
// passes.
enum vkb_texels { VKB_TEXELS_UNKNOWN, VKB_TEXELS_DIVIDED, VKB_TEXELS_SCALED, VKB_TEXELS_OTHER };

// The points on semaphores that submissions wait for and signal.
struct vkb_sync_point {
    VkSemaphore semaphore;  // VK_NULL_HANDLE: none
    uint64_t value;         // 0: the semaphore is binary
};

// Between a submission and others: a screen, and CUDA.
enum vkb_external_access { VKB_EXTERNAL_SCREEN, VKB_EXTERNAL_CUDA, VKB_EXTERNAL_COUNT };
struct vkb_sync {
    struct vkb_sync_point waits[VKB_EXTERNAL_COUNT], signals[VKB_EXTERNAL_COUNT];
};

struct vkb_device {
    struct vkb_instance *instance;
    struct vkb_messages messages;  // readable after the device is destroyed
    struct vkb_adapter_info adapter;
    VkDevice handle;
    struct VolkDeviceTable vk;
    VkQueue queue;
    struct vkb_workers *workers;  // of the host
    VkPhysicalDeviceMemoryProperties memory;
    VkPhysicalDeviceLimits limits;
    atomic_uint *allocations;                         // of memory, that are not freed
    uint32_t max_side;                                // of images that passes write
    VkFormatFeatureFlags features[VKB_FORMAT_COUNT];  // of images with optimal tiling
    enum vkb_texels texels;                           // found when it is first needed (probe.c)
    bool dispatch;          // compute shaders can write images of every format that methods have
    bool extended_formats;  // shaders can load images of formats such as rg32f
    // Colour images have linear tiling and lie in host-visible memory, which shaders also access as
    // buffers of 16-byte words. This is the case on a CPU: its memory is host memory.
    bool linear_texels;
    bool presents;  // VK_KHR_swapchain is there
    // Imported host memory starts and ends at multiples of this; 0: import is not supported.
    VkDeviceSize import_alignment;
    bool exports;        // buffers can be exported as descriptors
    bool timelines;      // so can timeline semaphores
    atomic_bool lost;    // other threads read it while the device is in use
    char lost_call[64];  // the Vulkan call that reported it first, or ""
    bool timed_out;      // lost because a wait took too long; it may still be busy
    VkFence idle;        // of vkb_device_wait_idle; null: not needed so far
    bool idle_pending;
    // Called between the slices of a long wait; true ends the wait. May be NULL.
    bool (*interrupted)(void *context);
    void *context;
    double frame_seconds;   // the longest wait for each frame
    uint64_t memory_limit;  // bytes that all images can take; 0: not known
};

// `device` must not move in memory, since its messages are in a linked list. Vulkan calls with it
// must be between vkb_messages_begin(&device->messages) and vkb_messages_end. These two functions
// do that themselves. `adapter` is the number of one of the driver's; "" is the system's loader.
bool vkb_device_create(struct vkb_device *device, uint32_t adapter, const char *driver,
                       bool validation, struct vkb_error *error);
void vkb_device_destroy(struct vkb_device *device);

// Whether images of `format` with optimal tiling support all `features`.
bool vkb_device_supports(const struct vkb_device *device, enum vkb_format format,
                         VkFormatFeatureFlags features);

// How the device uses host memory of the caller that it imports as a buffer.
VkBufferUsageFlags vkb_device_import_usage(const struct vkb_device *device);

// How a device uses buffers that it exports.
#define VKB_EXPORT_USAGE \
    (VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT \
     | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT)

// Submits the recorded commands. The unsignalled `fence` is signalled when the device has run them
// and all earlier submissions. The commands wait for a screen before VKB_ACCESS_ACQUIRED, and for
// CUDA before anything. `order` may be NULL. Device loss is stored in the device.
bool vkb_device_submit(struct vkb_device *device, VkCommandBuffer commands,
                       const struct vkb_sync *order, VkFence fence, struct vkb_error *error);
// Waits for the fence and resets it. If the wait takes longer than `frames` frames may take, the
// device counts as lost. Device loss is stored in the device. After a failure the device may still
// be busy.
bool vkb_device_wait(struct vkb_device *device, VkFence fence, uint32_t frames,
                     struct vkb_error *error);
// Remembers that the device was lost if an error says so.
void vkb_device_remember_loss(struct vkb_device *device, const struct vkb_error *error);
// Fails if the device was lost, with the call that reported it.
bool vkb_device_require(const struct vkb_device *device, struct vkb_error *error);
// Waits until the queue has done everything, as long as a frame may take after the submissions,
// which must be over.
bool vkb_device_wait_idle(struct vkb_device *device, struct vkb_error *error);
// Ends such a wait that failed, so that its fence can be destroyed.
bool vkb_device_end_idle(struct vkb_device *device, struct vkb_error *error);

// Creates a timeline semaphore at 0, which other interfaces of the same GPU can import. *descriptor
// is a new descriptor of it, which belongs to the caller. Needs device->timelines.
bool vkb_timeline_export(const struct vkb_device *device, VkSemaphore *semaphore, int *descriptor,
                         struct vkb_error *error);

#endif
