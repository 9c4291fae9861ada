// A surface, which is a window or a display without one, and its swapchain.
#ifndef VKB_SWAPCHAIN_H
#define VKB_SWAPCHAIN_H

#include "vulkan/device.h"

enum { VKB_FRAMES_IN_FLIGHT = 2 };

// What a swapchain is made for.
struct vkb_swapchain_spec {
    VkExtent2D extent;  // where the surface has no size of its own
    bool linear;        // the images get linear light, which the format encodes as sRGB
};

struct vkb_swapchain {
    VkSurfaceKHR surface;
    VkPresentModeKHR mode;
    struct vkb_swapchain_spec spec;
    VkSwapchainKHR handle;  // VK_NULL_HANDLE: the surface has no area
    VkExtent2D extent;
    struct vkb_swapchain_image {
        VkImage handle;
        VkSemaphore rendered;  // signalled when it can be presented
    } *images;
    uint32_t image_count;
    // By frame in flight: signalled when the image that was acquired can be written.
    VkSemaphore available[VKB_FRAMES_IN_FLIGHT];
    bool stale;  // it must be renewed before an image is acquired
};

// Takes over the surface, also on failure; VK_NULL_HANDLE: one without a window.
bool vkb_swapchain_create(const struct vkb_device *device, VkSurfaceKHR surface, bool mailbox,
                          struct vkb_swapchain *swapchain, struct vkb_error *error);
// This and vkb_swapchain_renew wait until the queue is idle. Destroying a zeroed swapchain is safe.
void vkb_swapchain_destroy(const struct vkb_device *device, struct vkb_swapchain *swapchain);

// Makes the images and semaphores anew, as large as the surface is now.
bool vkb_swapchain_renew(const struct vkb_device *device, struct vkb_swapchain *swapchain,
                         const struct vkb_swapchain_spec *spec, struct vkb_error *error);

// Acquires an image for that frame in flight, whose submission must be over. *index: VKB_NO_INDEX
// if the surface has changed (then the swapchain is stale) or gives no image for some time.
#define VKB_NO_INDEX UINT32_MAX
bool vkb_swapchain_acquire(struct vkb_device *device, struct vkb_swapchain *swapchain,
                           uint32_t frame, uint32_t *index, struct vkb_error *error);
// Presents an image after the submission that signals its semaphore.
bool vkb_swapchain_present(struct vkb_device *device, struct vkb_swapchain *swapchain,
                           uint32_t index, struct vkb_error *error);

#endif
