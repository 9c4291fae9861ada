// Screens: a surface, which is a window or a display without one, with its swapchain. A framebuffer
// is copied to the swapchain's image by the submission that renders it, and never read back.
#ifndef VKB_SCREEN_H
#define VKB_SCREEN_H

#include "execute/submission.h"
#include "vulkan/image.h"

enum { VKB_MAX_SCREEN_IMAGES = 16 };

struct vkb_screen {
    VkSurfaceKHR surface;
    VkExtent2D wanted;         // what the swapchain was made for, where the surface has no size
    bool linear;               // its images get linear light, which their format encodes as sRGB
    VkSwapchainKHR swapchain;  // VK_NULL_HANDLE: the surface has no area
    struct vkb_screen_image {
        struct vkb_image image;
        VkSemaphore rendered;  // signalled when the image can be presented
    } images[VKB_MAX_SCREEN_IMAGES];
    uint32_t index;  // of the image that was acquired last
    bool stale;      // the swapchain must be created again before an image is acquired
    struct vkb_screen *next;
};

// How a submission presents the first output of its plan.
struct vkb_show {
    struct vkb_screen *screen;
    VkExtent2D extent;  // of the swapchain's images, where the surface has no size of its own
    bool linear;
    bool acquired;  // the surface had an image
};

// Makes a screen, which owns the surface from now on, also on failure. VK_NULL_HANDLE: a surface
// without a window is created. The screen is added to a list. NULL on failure.
struct vkb_screen *vkb_screen_create(const struct vkb_device *device, VkSurfaceKHR surface,
                                     struct vkb_screen **screens, struct vkb_error *error);
// After vkb_device_wait_idle, if something was shown.
void vkb_screen_destroy(const struct vkb_device *device, struct vkb_screen *screen,
                        struct vkb_screen **screens);

#endif
