#include "vulkan/swapchain.h"

static bool find_mode(const struct vkb_device *device, bool mailbox,
                      struct vkb_swapchain *swapchain, struct vkb_error *error)
{
    VkPresentModeKHR modes[16];
    uint32_t count = sizeof modes / sizeof modes[0];
    VkResult result;

    swapchain->mode = mailbox ? VK_PRESENT_MODE_MAILBOX_KHR : VK_PRESENT_MODE_FIFO_KHR;
    result = VK_RESULT(device->instance->vk.vkGetPhysicalDeviceSurfacePresentModesKHR(
        device->adapter.physical, swapchain->surface, &count, modes));
    if (result != VK_INCOMPLETE
        && !vkb_check(error, result, "vkGetPhysicalDeviceSurfacePresentModesKHR"))
        return false;
    for (uint32_t i = 0; i < count; ++i)
        if (modes[i] == swapchain->mode)
            return true;
    return vkb_fail(error, VKB_ERROR_VALUE,
                    "mode: the surface has no \"mailbox\"; every surface has \"fifo\"");
}

// Mesa's drivers share the code of their surfaces.
static bool is_mesa(VkDriverId driver)
{
    switch (driver) {
    case VK_DRIVER_ID_MESA_RADV:
    case VK_DRIVER_ID_INTEL_OPEN_SOURCE_MESA:
    case VK_DRIVER_ID_MESA_LLVMPIPE:
    case VK_DRIVER_ID_MESA_TURNIP:
    case VK_DRIVER_ID_MESA_V3DV:
    case VK_DRIVER_ID_MESA_PANVK:
    case VK_DRIVER_ID_MESA_VENUS:
    case VK_DRIVER_ID_MESA_DOZEN:
        return true;
    default:
        return false;
    }
}

static bool create_headless(const struct vkb_device *device, VkSurfaceKHR *surface,
                            struct vkb_error *error)
{
    const struct vkb_instance *instance = device->instance;

    // The loader offers the extension if any installed driver has it, and Vulkan does not tell
    // which. The loader passes the surface to the other drivers, too, and NVIDIA's driver 580
    // crashes then.
    if (!instance->vk.vkCreateHeadlessSurfaceEXT || !is_mesa(device->adapter.driver_id))
        return vkb_fail(error, VKB_ERROR_GENERAL,
                        "a surface without a window needs VK_EXT_headless_surface, which the "
                        "driver of %s lacks; Mesa's lavapipe 25 has it",
                        device->adapter.name);
    return VK(error, instance->vk.vkCreateHeadlessSurfaceEXT(
                         instance->handle,
                         &(VkHeadlessSurfaceCreateInfoEXT){
                             .sType = VK_STRUCTURE_TYPE_HEADLESS_SURFACE_CREATE_INFO_EXT,
                         },
                         NULL, surface));
}

bool vkb_swapchain_create(const struct vkb_device *device, VkSurfaceKHR surface, bool mailbox,
                          struct vkb_swapchain *swapchain, struct vkb_error *error)
{
    const struct vkb_adapter_info *adapter = &device->adapter;
    VkBool32 supported = VK_FALSE;

    *swapchain = (struct vkb_swapchain){.surface = surface, .stale = true};
    bool done = device->presents
             || vkb_fail(error, VKB_ERROR_GENERAL,
                         "%s cannot present: its driver lacks VK_KHR_surface or VK_KHR_swapchain",
                         adapter->name);
    done = done && (surface || create_headless(device, &swapchain->surface, error))
        && VK(error, device->instance->vk.vkGetPhysicalDeviceSurfaceSupportKHR(
                         adapter->physical, adapter->queue_family, swapchain->surface, &supported));
    if (done && !supported)
        done =
            vkb_fail(error, VKB_ERROR_GENERAL, "%s cannot present on this surface", adapter->name);
    done = done && find_mode(device, mailbox, swapchain, error);
    if (!done)
        vkb_swapchain_destroy(device, swapchain);
    return done;
}

// Keeps the surface and the handle, which the next swapchain takes over.
static void destroy_images(const struct vkb_device *device, struct vkb_swapchain *swapchain)
{
    const struct VolkDeviceTable *vk = &device->vk;

    for (uint32_t i = 0; i < swapchain->image_count; ++i)
        vk->vkDestroySemaphore(device->handle, swapchain->images[i].rendered, NULL);
    vkb_free(swapchain->images);
    swapchain->images = NULL;
    swapchain->image_count = 0;
    for (uint32_t i = 0; i < VKB_FRAMES_IN_FLIGHT; ++i) {
        vk->vkDestroySemaphore(device->handle, swapchain->available[i], NULL);
        swapchain->available[i] = VK_NULL_HANDLE;
    }
}

void vkb_swapchain_destroy(const struct vkb_device *device, struct vkb_swapchain *swapchain)
{
    // No fence tells when the last images are presented.
    if (swapchain->handle)
        (void)VK_RESULT(device->vk.vkQueueWaitIdle(device->queue));
    destroy_images(device, swapchain);
    if (swapchain->handle)
        device->vk.vkDestroySwapchainKHR(device->handle, swapchain->handle, NULL);
    if (swapchain->surface)
        device->instance->vk.vkDestroySurfaceKHR(device->instance->handle, swapchain->surface,
                                                 NULL);
    *swapchain = (struct vkb_swapchain){0};
}

// Whether blits can write the format, and it keeps levels, or encodes linear light.
static bool fits(const struct vkb_device *device, const VkSurfaceFormatKHR *format, bool linear)
{
    VkFormatProperties properties;
    const bool is_linear =
        format->format == VK_FORMAT_B8G8R8A8_SRGB || format->format == VK_FORMAT_R8G8B8A8_SRGB;

    if (!is_linear && format->format != VK_FORMAT_B8G8R8A8_UNORM
        && format->format != VK_FORMAT_R8G8B8A8_UNORM)
        return false;
    device->instance->vk.vkGetPhysicalDeviceFormatProperties(device->adapter.physical,
                                                             format->format, &properties);
    return is_linear == linear && format->colorSpace == VK_COLOR_SPACE_SRGB_NONLINEAR_KHR
        && (properties.optimalTilingFeatures & VK_FORMAT_FEATURE_BLIT_DST_BIT);
}

static bool find_format(const struct vkb_device *device, VkSurfaceKHR surface, bool linear,
                        VkFormat *format, struct vkb_error *error)
{
    VkSurfaceFormatKHR formats[128];
    uint32_t count = sizeof formats / sizeof formats[0];
    VkResult result = VK_RESULT(device->instance->vk.vkGetPhysicalDeviceSurfaceFormatsKHR(
        device->adapter.physical, surface, &count, formats));

    if (result != VK_INCOMPLETE
        && !vkb_check(error, result, "vkGetPhysicalDeviceSurfaceFormatsKHR"))
        return false;
    for (uint32_t i = 0; i < count; ++i)
        if (fits(device, &formats[i], linear)) {
            *format = formats[i].format;
            return true;
        }
    return vkb_fail(error, VKB_ERROR_GENERAL, "the surface has no 8-bit format %s",
                    linear ? "that encodes linear light (sRGB)" : "for levels (UNORM)");
}

static uint32_t clamp(uint32_t value, uint32_t low, uint32_t high)
{
    return value < low ? low : value > high ? high : value;
}

// The size that the surface has, or takes; zero while it is minimized.
static VkExtent2D find_extent(const VkSurfaceCapabilitiesKHR *surface, const VkExtent2D *wanted)
{
    const VkExtent2D *low = &surface->minImageExtent, *high = &surface->maxImageExtent;

    if (surface->currentExtent.width != UINT32_MAX)
        return surface->currentExtent;
    if (wanted->width == 0 || wanted->height == 0)
        return (VkExtent2D){0, 0};
    return (VkExtent2D){clamp(wanted->width, low->width, high->width),
                        clamp(wanted->height, low->height, high->height)};
}

static bool create_handle(const struct vkb_device *device, struct vkb_swapchain *swapchain,
                          const VkSurfaceCapabilitiesKHR *surface, struct vkb_error *error)
{
    const VkSwapchainKHR old = swapchain->handle;
    const uint32_t most = surface->maxImageCount ? surface->maxImageCount : UINT32_MAX;
    VkFormat format = VK_FORMAT_UNDEFINED;

    if (!find_format(device, swapchain->surface, swapchain->spec.linear, &format, error))
        return false;
    const bool done = VK(error, device->vk.vkCreateSwapchainKHR(
                                    device->handle,
                                    &(VkSwapchainCreateInfoKHR){
                                        .sType = VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR,
                                        .surface = swapchain->surface,
                                        .minImageCount = clamp(surface->minImageCount + 1, 1, most),
                                        .imageFormat = format,
                                        .imageColorSpace = VK_COLOR_SPACE_SRGB_NONLINEAR_KHR,
                                        .imageExtent = swapchain->extent,
                                        .imageArrayLayers = 1,
                                        .imageUsage = VK_IMAGE_USAGE_TRANSFER_DST_BIT,
                                        .preTransform = surface->currentTransform,
                                        // The lowest bit is opaque.
                                        .compositeAlpha = surface->supportedCompositeAlpha
                                                        & (~surface->supportedCompositeAlpha + 1),
                                        .presentMode = swapchain->mode,
                                        .clipped = VK_TRUE,
                                        .oldSwapchain = old,
                                    },
                                    NULL, &swapchain->handle));
    device->vk.vkDestroySwapchainKHR(device->handle, old, NULL);
    if (!done)
        swapchain->handle = VK_NULL_HANDLE;
    return done;
}

static bool create_semaphore(const struct vkb_device *device, VkSemaphore *semaphore,
                             struct vkb_error *error)
{
    return VK(error,
              device->vk.vkCreateSemaphore(device->handle,
                                           &(VkSemaphoreCreateInfo){
                                               .sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO,
                                           },
                                           NULL, semaphore));
}

static bool create_images(const struct vkb_device *device, struct vkb_swapchain *swapchain,
                          struct vkb_error *error)
{
    const struct VolkDeviceTable *vk = &device->vk;
    VkImage handles[32];
    uint32_t count = sizeof handles / sizeof handles[0];

    if (!VK(error, vk->vkGetSwapchainImagesKHR(device->handle, swapchain->handle, &count, handles))
        || !(swapchain->images = vkb_alloc(error, count, sizeof *swapchain->images)))
        return false;
    swapchain->image_count = count;
    for (uint32_t i = 0; i < count; ++i) {
        swapchain->images[i].handle = handles[i];
        if (!create_semaphore(device, &swapchain->images[i].rendered, error))
            return false;
    }
    for (uint32_t i = 0; i < VKB_FRAMES_IN_FLIGHT; ++i)
        if (!create_semaphore(device, &swapchain->available[i], error))
            return false;
    return true;
}

bool vkb_swapchain_renew(const struct vkb_device *device, struct vkb_swapchain *swapchain,
                         const struct vkb_swapchain_spec *spec, struct vkb_error *error)
{
    VkSurfaceCapabilitiesKHR surface;

    swapchain->stale = true;
    // The device may have finished all commands, while presentations still wait for semaphores.
    if (!VK(error, device->vk.vkQueueWaitIdle(device->queue))
        || !VK(error, device->instance->vk.vkGetPhysicalDeviceSurfaceCapabilitiesKHR(
                          device->adapter.physical, swapchain->surface, &surface)))
        return false;
    if (!(surface.supportedUsageFlags & VK_IMAGE_USAGE_TRANSFER_DST_BIT))
        return vkb_fail(error, VKB_ERROR_GENERAL, "the surface's images cannot be copied to");
    destroy_images(device, swapchain);
    swapchain->spec = *spec;
    swapchain->extent = find_extent(&surface, &spec->extent);
    if (swapchain->extent.width == 0 || swapchain->extent.height == 0)
        return true;
    if (!create_handle(device, swapchain, &surface, error)
        || !create_images(device, swapchain, error))
        return false;
    swapchain->stale = false;
    return true;
}

bool vkb_swapchain_acquire(struct vkb_device *device, struct vkb_swapchain *swapchain,
                           uint32_t frame, uint32_t *index, struct vkb_error *error)
{
    const uint64_t slice = 50000000;  // ns
    const int slices = 20;            // some compositors give a hidden window no image
    VkResult result = VK_TIMEOUT;

    *index = VKB_NO_INDEX;
    for (int i = 0; i < slices && (result == VK_TIMEOUT || result == VK_NOT_READY); ++i) {
        if (i > 0 && !vkb_device_go_on(device, error))
            return false;
        result = VK_RESULT(device->vk.vkAcquireNextImageKHR(device->handle, swapchain->handle,
                                                            slice, swapchain->available[frame],
                                                            VK_NULL_HANDLE, index));
    }
    swapchain->stale = result == VK_ERROR_OUT_OF_DATE_KHR || result == VK_SUBOPTIMAL_KHR;
    if (result == VK_SUCCESS || result == VK_SUBOPTIMAL_KHR)
        return true;
    *index = VKB_NO_INDEX;
    return swapchain->stale || result == VK_TIMEOUT || result == VK_NOT_READY
        || vkb_check(error, result, "vkAcquireNextImageKHR");
}

bool vkb_swapchain_present(struct vkb_device *device, struct vkb_swapchain *swapchain,
                           uint32_t index, struct vkb_error *error)
{
    const VkResult result = VK_RESULT(device->vk.vkQueuePresentKHR(
        device->queue, &(VkPresentInfoKHR){
                           .sType = VK_STRUCTURE_TYPE_PRESENT_INFO_KHR,
                           .waitSemaphoreCount = 1,
                           .pWaitSemaphores = &swapchain->images[index].rendered,
                           .swapchainCount = 1,
                           .pSwapchains = &swapchain->handle,
                           .pImageIndices = &index,
                       }));

    swapchain->stale = swapchain->stale || result != VK_SUCCESS;
    return result == VK_SUBOPTIMAL_KHR || result == VK_ERROR_OUT_OF_DATE_KHR
        || vkb_check(error, result, "vkQueuePresentKHR");
}
