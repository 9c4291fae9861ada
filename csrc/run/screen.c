#include "run/screen.h"

#include "run/frame.h"
#include "vulkan/labels.h"

struct vkb_screen *vkb_screen_create(const struct vkb_device *device, struct vkb_frame *frame,
                                     VkSurfaceKHR surface, bool mailbox, struct vkb_error *error)
{
    struct vkb_swapchain swapchain;

    if (!vkb_swapchain_create(device, surface, mailbox, &swapchain, error))
        return NULL;
    struct vkb_screen *screen = vkb_alloc(error, 1, sizeof *screen);
    if (!screen) {
        vkb_swapchain_destroy(device, &swapchain);
        return NULL;
    }
    screen->swapchain = swapchain;
    screen->next = frame->screens;
    frame->screens = screen;
    return screen;
}

void vkb_screen_destroy(const struct vkb_device *device, struct vkb_frame *frame,
                        struct vkb_screen *screen)
{
    struct vkb_screen **link = &frame->screens;

    while (*link != screen)
        link = &(*link)->next;
    *link = screen->next;
    for (uint32_t i = 0; i < VKB_FRAMES_IN_FLIGHT; ++i)
        if (screen->copies[i])
            vkb_submissions_give_back(device, &frame->submissions, screen->copies[i]);
    vkb_swapchain_destroy(device, &screen->swapchain);
    vkb_free(screen);
}

// Where a picture of these proportions lies in the middle of the surface.
static VkRect2D fit(VkExtent2D extent, uint32_t width, uint32_t height)
{
    VkExtent2D size = extent;

    if ((uint64_t)extent.width * height > (uint64_t)extent.height * width)
        size.width = (uint32_t)((uint64_t)extent.height * width / height);
    else
        size.height = (uint32_t)((uint64_t)extent.width * height / width);
    size.width += size.width == 0;
    size.height += size.height == 0;
    return (VkRect2D){
        .offset = {(int32_t)(extent.width - size.width) / 2,
                   (int32_t)(extent.height - size.height) / 2},
        .extent = size,
    };
}

static void record_blit(const struct vkb_device *device, VkCommandBuffer commands,
                        const struct vkb_image *from, VkImage to, const VkRect2D *place)
{
    const VkImageLayout layout = vkb_access_layout(VKB_ACCESS_COPY_TARGET);
    const VkImageSubresourceLayers colour = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    const bool scaled = from->width != place->extent.width || from->height != place->extent.height;
    const bool filtered = vkb_device_supports(device, from->format,
                                              VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT);

    device->vk.vkCmdBlitImage(
        commands, from->handle, vkb_image_layout(from, VKB_ACCESS_COPY_SOURCE), to, layout, 1,
        &(VkImageBlit){
            .srcSubresource = colour,
            .srcOffsets = {{0, 0, 0}, {(int32_t)from->width, (int32_t)from->height, 1}},
            .dstSubresource = colour,
            .dstOffsets = {{place->offset.x, place->offset.y, 0},
                           {place->offset.x + (int32_t)place->extent.width,
                            place->offset.y + (int32_t)place->extent.height, 1}},
        },
        scaled && filtered ? VK_FILTER_LINEAR : VK_FILTER_NEAREST);
}

static void record(const struct vkb_device *device, VkCommandBuffer commands,
                   struct vkb_image *from, const struct vkb_image_row *frame,
                   const struct vkb_swapchain *swapchain, uint32_t index)
{
    const VkRect2D place = fit(swapchain->extent, frame->width, frame->height);
    const VkImageSubresourceRange whole = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    VkImageMemoryBarrier barrier = {
        .oldLayout = vkb_access_layout(VKB_ACCESS_ACQUIRED),
        .newLayout = vkb_access_layout(VKB_ACCESS_COPY_TARGET),
        .image = swapchain->images[index].handle,
        .subresourceRange = whole,
    };

    vkb_image_transition(device, commands, from, VKB_ACCESS_COPY_SOURCE);
    vkb_barrier_record(device, commands, &barrier, false, VKB_ACCESS_ACQUIRED,
                       VKB_ACCESS_COPY_TARGET);
    barrier.oldLayout = barrier.newLayout;
    if (place.extent.width != swapchain->extent.width
        || place.extent.height != swapchain->extent.height) {
        device->vk.vkCmdClearColorImage(commands, barrier.image, barrier.newLayout,
                                        &(VkClearColorValue){.float32 = {0.0f, 0.0f, 0.0f, 1.0f}},
                                        1, &whole);
        vkb_barrier_record(device, commands, &barrier, false, VKB_ACCESS_COPY_TARGET,
                           VKB_ACCESS_COPY_TARGET);
    }
    record_blit(device, commands, from, barrier.image, &place);
    barrier.newLayout = vkb_access_layout(VKB_ACCESS_PRESENTED);
    vkb_barrier_record(device, commands, &barrier, false, VKB_ACCESS_COPY_TARGET,
                       VKB_ACCESS_PRESENTED);
}

// Submits the copy to the image that was acquired.
static bool submit_copy(struct vkb_device *device, struct vkb_frame *frame,
                        struct vkb_screen *screen, struct vkb_cached_image *image,
                        const struct vkb_image_row *final, uint32_t index, struct vkb_error *error)
{
    const struct vkb_swapchain *swapchain = &screen->swapchain;
    const enum vkb_access access = image->image.access;
    struct vkb_submission *copy;

    if (!vkb_submissions_take(device, &frame->submissions, &copy, error))
        return false;
    // What its images' submission keeps, this one keeps, too.
    copy->number = image->used;
    bool done = vkb_commands_begin(device, &copy->commands, error);
    if (done) {
        vkb_label_begin(device, copy->commands.buffer, "present");
        record(device, copy->commands.buffer, &image->image, final, swapchain, index);
        vkb_label_end(device, copy->commands.buffer);
    }
    done = done
        && vkb_submission_submit(device, copy,
                                 &(struct vkb_semaphores){
                                     .wait = swapchain->available[screen->frame],
                                     .signal = swapchain->images[index].rendered,
                                     .stages = vkb_access_stages(VKB_ACCESS_ACQUIRED),
                                 },
                                 error);
    if (!done) {
        // What was recorded does not run.
        image->image.access = access;
        vkb_commands_destroy(device, &copy->commands);
        vkb_submissions_give_back(device, &frame->submissions, copy);
        return false;
    }
    screen->copies[screen->frame] = copy;
    return true;
}

// Waits for the frame in flight that is the next one, and acquires an image for it.
static bool acquire(struct vkb_device *device, struct vkb_frame *frame, struct vkb_screen *screen,
                    const struct vkb_swapchain_spec *spec, uint32_t *index, struct vkb_error *error)
{
    struct vkb_swapchain *swapchain = &screen->swapchain;
    struct vkb_submission **copy = &screen->copies[screen->frame];
    const int attempts = 3;  // of a window that is being resized

    *index = VKB_NO_INDEX;
    if (*copy) {
        if (!vkb_submission_wait(device, &frame->submissions, *copy, error))
            return false;
        vkb_submissions_give_back(device, &frame->submissions, *copy);
        *copy = NULL;
    }
    for (int i = 0; i < attempts && *index == VKB_NO_INDEX; ++i) {
        if (swapchain->stale || swapchain->spec.linear != spec->linear
            || swapchain->spec.extent.width != spec->extent.width
            || swapchain->spec.extent.height != spec->extent.height) {
            if (!vkb_swapchain_renew(device, swapchain, spec, error))
                return false;
            if (swapchain->stale)
                return true;
        }
        if (!vkb_swapchain_acquire(device, swapchain, screen->frame, index, error))
            return false;
        if (*index == VKB_NO_INDEX && !swapchain->stale)
            return true;
    }
    return true;
}

bool vkb_screen_show(struct vkb_device *device, struct vkb_frame *frame, struct vkb_screen *screen,
                     const struct vkb_plan *plan, const struct vkb_swapchain_spec *spec,
                     bool *shown, struct vkb_error *error)
{
    const struct vkb_graph *graph = &plan->graph;
    const struct vkb_image_row *row = &graph->images[plan->outputs[0]];
    struct vkb_cached_image *image = vkb_image_cache_find(&frame->cache, row);
    uint32_t index;

    *shown = false;
    if (vkb_formats[row->format].aspect != VK_IMAGE_ASPECT_COLOR_BIT
        || !vkb_device_supports(device, row->format, VK_FORMAT_FEATURE_BLIT_SRC_BIT))
        return vkb_fail(error, VKB_ERROR_VALUE, "attachment: '%s' is no colour image to show",
                        row->name);
    if (!acquire(device, frame, screen, spec, &index, error))
        return false;
    if (index == VKB_NO_INDEX)
        return true;
    *shown = submit_copy(device, frame, screen, image,
                         &graph->images[vkb_graph_find(graph, "final")], index, error)
          && vkb_swapchain_present(device, &screen->swapchain, index, error);
    screen->frame = (screen->frame + 1) % VKB_FRAMES_IN_FLIGHT;
    // An image that was acquired and not presented comes back with the swapchain alone.
    screen->swapchain.stale = screen->swapchain.stale || !*shown;
    device->lost = device->lost || (!*shown && error->kind == VKB_ERROR_DEVICE_LOST);
    return *shown;
}
