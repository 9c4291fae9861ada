// Surfaces on which framebuffers are presented. The framebuffer is copied to the swapchain's image
// by a submission of its own, and never read back.
#ifndef VKB_SCREEN_H
#define VKB_SCREEN_H

#include "graph/plan.h"
#include "run/submission.h"
#include "vulkan/swapchain.h"

struct vkb_frame;

struct vkb_screen {
    struct vkb_swapchain swapchain;
    // By frame in flight: the copy that was submitted last. Its fence guards the frame's semaphore
    // and command buffer.
    struct vkb_submission *copies[VKB_FRAMES_IN_FLIGHT];
    uint32_t frame;  // in flight, the next one
    struct vkb_screen *next;
};

// Makes a screen of a surface, as vkb_swapchain_create does; NULL on failure. The frame owns it.
struct vkb_screen *vkb_screen_create(const struct vkb_device *device, struct vkb_frame *frame,
                                     VkSurfaceKHR surface, bool mailbox, struct vkb_error *error);
// After vkb_submissions_wait or vkb_frame_end.
void vkb_screen_destroy(const struct vkb_device *device, struct vkb_frame *frame,
                        struct vkb_screen *screen);

// Presents the plan's first output, which an earlier submission has left in the frame's images. The
// output is scaled to the surface. If the proportions of `final` differ from those of the surface,
// black bars are added. *shown: whether the swapchain had an image.
bool vkb_screen_show(struct vkb_device *device, struct vkb_frame *frame, struct vkb_screen *screen,
                     const struct vkb_plan *plan, const struct vkb_swapchain_spec *spec,
                     bool *shown, struct vkb_error *error);

#endif
