#include "transfer/screen.h"

#include "execute/record.h"

#include "vulkan/labels.h"

#include <string.h>

static bool create_headless(const struct vkb_device *device, VkSurfaceKHR *surface,
                            struct vkb_error *error)
{
    const struct vkb_instance_table *vk = &device->instance->vk;
    const VkHeadlessSurfaceCreateInfoEXT info = {
        .sType = VK_STRUCTURE_TYPE_HEADLESS_SURFACE_CREATE_INFO_EXT,
    };
    const VkDriverId driver = device->adapter.driver_id;
    const bool mesa = driver == VK_DRIVER_ID_MESA_LLVMPIPE || driver == VK_DRIVER_ID_MESA_RADV
                   || driver == VK_DRIVER_ID_INTEL_OPEN_SOURCE_MESA;

    // The loader offers the extension if any installed driver has it, and Vulkan does not tell
    // which. The loader passes the surface to the other drivers, too, and NVIDIA's driver 580
    // crashes then.
    if (!vk->vkCreateHeadlessSurfaceEXT || !mesa)
        return vkb_fail(error, VKB_ERROR_GENERAL,
                        "a surface without a window needs VK_EXT_headless_surface, which the "
                        "driver of %s lacks; Mesa's lavapipe 25 has it",
                        device->adapter.name);
    return VK(error,
              vk->vkCreateHeadlessSurfaceEXT(device->instance->handle, &info, NULL, surface));
}

static bool check_surface(const struct vkb_device *device, const struct vkb_screen *screen,
                          struct vkb_error *error)
{
    const struct vkb_instance_table *vk = &device->instance->vk;
    const struct vkb_adapter_info *adapter = &device->adapter;
    VkBool32 supported;

    if (!VK(error, vk->vkGetPhysicalDeviceSurfaceSupportKHR(
                       adapter->physical, adapter->queue_family, screen->surface, &supported)))
        return false;
    return (supported && device->presents)
        || vkb_fail(error, VKB_ERROR_GENERAL, "%s cannot present on this surface", adapter->name);
}

struct vkb_screen *vkb_screen_create(const struct vkb_device *device, VkSurfaceKHR surface,
                                     struct vkb_screen **screens, struct vkb_error *error)
{
    struct vkb_screen *screen = vkb_alloc(error, 1, sizeof *screen);

    if (!screen) {
        if (surface)
            device->instance->vk.vkDestroySurfaceKHR(device->instance->handle, surface, NULL);
        return NULL;
    }
    screen->surface = surface;
    screen->stale = true;
    screen->next = *screens;
    *screens = screen;
    if ((surface || create_headless(device, &screen->surface, error))
        && check_surface(device, screen, error))
        return screen;
    vkb_screen_destroy(device, screen, screens);
    return NULL;
}

// After a wait for the queue: presentations wait for the semaphores, and no fence tells when they
// have waited.
static void destroy_swapchain(const struct vkb_device *device, struct vkb_screen *screen)
{
    if (!screen->swapchain)
        return;
    for (uint32_t i = 0; i < VKB_MAX_SCREEN_IMAGES; ++i)
        device->vk.vkDestroySemaphore(device->handle, screen->images[i].rendered, NULL);
    memset(screen->images, 0, sizeof screen->images);
    device->vk.vkDestroySwapchainKHR(device->handle, screen->swapchain, NULL);
    screen->swapchain = VK_NULL_HANDLE;
}

void vkb_screen_destroy(const struct vkb_device *device, struct vkb_screen *screen,
                        struct vkb_screen **screens)
{
    while (*screens != screen)
        screens = &(*screens)->next;
    *screens = screen->next;
    destroy_swapchain(device, screen);
    if (screen->surface)
        device->instance->vk.vkDestroySurfaceKHR(device->instance->handle, screen->surface, NULL);
    vkb_free(screen);
}

// The format keeps levels, or encodes linear light. Vulkan demands of all four that blits can write
// them.
static bool find_format(const struct vkb_device *device, const struct vkb_screen *screen,
                        VkFormat *format, struct vkb_error *error)
{
    const VkFormat bgra = screen->linear ? VK_FORMAT_B8G8R8A8_SRGB : VK_FORMAT_B8G8R8A8_UNORM;
    const VkFormat rgba = screen->linear ? VK_FORMAT_R8G8B8A8_SRGB : VK_FORMAT_R8G8B8A8_UNORM;
    VkSurfaceFormatKHR formats[256];
    uint32_t count = sizeof formats / sizeof formats[0];

    if (!VK(error, device->instance->vk.vkGetPhysicalDeviceSurfaceFormatsKHR(
                       device->adapter.physical, screen->surface, &count, formats)))
        return false;
    for (uint32_t i = 0; i < count; ++i) {
        *format = formats[i].format;
        if (formats[i].colorSpace == VK_COLOR_SPACE_SRGB_NONLINEAR_KHR
            && (*format == bgra || *format == rgba))
            return true;
    }
    return vkb_fail(error, VKB_ERROR_GENERAL, "the surface has no 8-bit format %s",
                    screen->linear ? "that encodes linear light (sRGB)" : "for levels (UNORM)");
}

static uint32_t clamp(uint64_t value, uint32_t low, uint32_t high)
{
    return value < low ? low : value > high ? high : (uint32_t)value;
}

static bool create_images(const struct vkb_device *device, struct vkb_screen *screen,
                          VkExtent2D extent, struct vkb_error *error)
{
    VkImage handles[VKB_MAX_SCREEN_IMAGES];
    uint32_t count = VKB_MAX_SCREEN_IMAGES;
    const VkSemaphoreCreateInfo info = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO};

    if (!VK(error,
            device->vk.vkGetSwapchainImagesKHR(device->handle, screen->swapchain, &count, handles)))
        return false;
    for (uint32_t i = 0; i < count; ++i) {
        screen->images[i].image = (struct vkb_image){
            .handle = handles[i],
            .format = VKB_FORMAT_RGBA8_UNORM,
            .width = extent.width,
            .height = extent.height,
            .layers = 1,
            .levels = 1,
        };
        if (!VK(error, device->vk.vkCreateSemaphore(device->handle, &info, NULL,
                                                    &screen->images[i].rendered)))
            return false;
    }
    return true;
}

// Creates the swapchain as large as the surface is now; none if the surface has no area.
static bool renew(struct vkb_device *device, struct vkb_screen *screen, const struct vkb_show *show,
                  struct vkb_submissions *submissions, struct vkb_error *error)
{
    VkSurfaceCapabilitiesKHR surface;
    VkFormat format;

    if ((screen->swapchain
         && !(vkb_submissions_wait(device, submissions, error)
              && vkb_device_wait_idle(device, error)))
        || !VK(error, device->instance->vk.vkGetPhysicalDeviceSurfaceCapabilitiesKHR(
                          device->adapter.physical, screen->surface, &surface)))
        return false;
    destroy_swapchain(device, screen);
    screen->wanted = show->extent;
    screen->linear = show->linear;
    if (!(surface.supportedUsageFlags & VK_IMAGE_USAGE_TRANSFER_DST_BIT))
        return vkb_fail(error, VKB_ERROR_GENERAL, "the surface's images cannot be copied to");
    const VkExtent2D *low = &surface.minImageExtent, *high = &surface.maxImageExtent;
    VkExtent2D extent = surface.currentExtent;
    // Then the surface takes the size of its images.
    if (extent.width == UINT32_MAX)
        extent = (VkExtent2D){clamp(show->extent.width, low->width, high->width),
                              clamp(show->extent.height, low->height, high->height)};
    // It is minimized.
    if (extent.width == 0 || extent.height == 0)
        return true;
    if (!find_format(device, screen, &format, error))
        return false;
    const uint32_t most = surface.maxImageCount ? surface.maxImageCount : UINT32_MAX;
    const VkSwapchainCreateInfoKHR info = {
        .sType = VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR,
        .surface = screen->surface,
        .minImageCount = clamp(surface.minImageCount + 1, 1, most),
        .imageFormat = format,
        .imageColorSpace = VK_COLOR_SPACE_SRGB_NONLINEAR_KHR,
        .imageExtent = extent,
        .imageArrayLayers = 1,
        .imageUsage = VK_IMAGE_USAGE_TRANSFER_DST_BIT,
        .preTransform = surface.currentTransform,
        // The lowest bit is opaque.
        .compositeAlpha = surface.supportedCompositeAlpha & (~surface.supportedCompositeAlpha + 1),
        .presentMode = VK_PRESENT_MODE_FIFO_KHR,
        .clipped = VK_TRUE,
    };
    if (!VK(error,
            device->vk.vkCreateSwapchainKHR(device->handle, &info, NULL, &screen->swapchain)))
        screen->swapchain = VK_NULL_HANDLE;
    return screen->swapchain && create_images(device, screen, extent, error);
}

static bool acquire(struct vkb_device *device, struct vkb_submissions *submissions,
                    struct vkb_show *show, VkSemaphore available, struct vkb_error *error)
{
    const uint64_t patience = 1000000000;  // ns; some compositors give a hidden window no image
    struct vkb_screen *screen = show->screen;
    const bool fits = !screen->stale && screen->linear == show->linear
                   && screen->wanted.width == show->extent.width
                   && screen->wanted.height == show->extent.height;

    // Until the image is presented: without that, it comes back with its swapchain alone.
    screen->stale = true;
    if (!fits && !renew(device, screen, show, submissions, error))
        return false;
    if (!screen->swapchain)
        return true;
    const VkResult result = VK_RESULT(device->vk.vkAcquireNextImageKHR(
        device->handle, screen->swapchain, patience, available, VK_NULL_HANDLE, &screen->index));
    show->acquired = result == VK_SUCCESS || result == VK_SUBOPTIMAL_KHR;
    return show->acquired || result == VK_ERROR_OUT_OF_DATE_KHR || result == VK_TIMEOUT
        || vkb_check(error, result, "vkAcquireNextImageKHR");
}

static void copy_to_screen(const struct vkb_device *device, VkCommandBuffer commands,
                           struct vkb_screen *screen, struct vkb_image *from)
{
    struct vkb_image *to = &screen->images[screen->index].image;
    const VkImageLayout layout = vkb_access_layout(VKB_ACCESS_COPY_TARGET);
    const VkImageSubresourceRange whole = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    const VkClearColorValue black = {.float32 = {0.0f, 0.0f, 0.0f, 1.0f}};
    // As large as the proportions allow, in the middle.
    const uint32_t width = clamp((uint64_t)to->height * from->width / from->height, 1, to->width);
    const uint32_t height = clamp((uint64_t)to->width * from->height / from->width, 1, to->height);
    const int32_t x = (int32_t)(to->width - width) / 2, y = (int32_t)(to->height - height) / 2;
    const VkImageBlit blit = {
        .srcSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1},
        .srcOffsets = {{0, 0, 0}, {(int32_t)from->width, (int32_t)from->height, 1}},
        .dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1},
        .dstOffsets = {{x, y, 0}, {x + (int32_t)width, y + (int32_t)height, 1}},
    };
    const bool filtered = (from->width != width || from->height != height)
                       && vkb_device_supports(device, from->format,
                                              VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT);

    vkb_label_begin(device, commands, "present");
    to->access = VKB_ACCESS_ACQUIRED;
    vkb_image_transition(device, commands, from, VKB_ACCESS_COPY_SOURCE);
    vkb_image_transition(device, commands, to, VKB_ACCESS_COPY_TARGET);
    if (width != to->width || height != to->height) {
        device->vk.vkCmdClearColorImage(commands, to->handle, layout, &black, 1, &whole);
        vkb_image_transition(device, commands, to, VKB_ACCESS_COPY_TARGET);
    }
    device->vk.vkCmdBlitImage(commands, from->handle,
                              vkb_image_layout(from, VKB_ACCESS_COPY_SOURCE), to->handle, layout, 1,
                              &blit, filtered ? VK_FILTER_LINEAR : VK_FILTER_NEAREST);
    vkb_image_transition(device, commands, to, VKB_ACCESS_PRESENTED);
    vkb_label_end(device, commands);
}

static bool present(struct vkb_device *device, struct vkb_screen *screen, struct vkb_error *error)
{
    const VkPresentInfoKHR info = {
        .sType = VK_STRUCTURE_TYPE_PRESENT_INFO_KHR,
        .waitSemaphoreCount = 1,
        .pWaitSemaphores = &screen->images[screen->index].rendered,
        .swapchainCount = 1,
        .pSwapchains = &screen->swapchain,
        .pImageIndices = &screen->index,
    };
    const VkResult result = VK_RESULT(device->vk.vkQueuePresentKHR(device->queue, &info));

    screen->stale = result != VK_SUCCESS;
    if (result == VK_SUBOPTIMAL_KHR || result == VK_ERROR_OUT_OF_DATE_KHR
        || vkb_check(error, result, "vkQueuePresentKHR"))
        return true;
    vkb_device_remember_loss(device, error);
    return false;
}

static bool prepare(struct vkb_run *run, struct vkb_request *requests, uint32_t request_count,
                    struct vkb_error *error)
{
    const VkSemaphore available = run->submission->commands.available;

    (void)requests, (void)request_count;
    if (!run->show)
        return true;
    if (!acquire(run->device, &run->frame->submissions, run->show, available, error))
        return false;
    if (run->show->acquired) {
        const struct vkb_screen *screen = run->show->screen;
        run->sync.waits[VKB_EXTERNAL_SCREEN].semaphore = available;
        run->sync.signals[VKB_EXTERNAL_SCREEN].semaphore = screen->images[screen->index].rendered;
    }
    return true;
}

static bool record(struct vkb_run *run, struct vkb_error *error)
{
    (void)error;
    if (run->show)
        copy_to_screen(run->device, run->submission->commands.buffer, run->show->screen,
                       &run->images[run->request->plan->outputs[0]]->image);
    return true;
}

static bool finish(struct vkb_run *run, const struct vkb_request *requests, uint32_t request_count,
                   struct vkb_error *error)
{
    (void)requests, (void)request_count;
    return !run->show || present(run->device, run->show->screen, error);
}

const struct vkb_sink vkb_screen_sink = {prepare, record, finish};
