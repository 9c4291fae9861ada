#include "timing.h"

#include <math.h>

void vkb_timer_destroy(const struct vkb_device *device, struct vkb_timer *timer)
{
    device->vk.vkDestroyQueryPool(device->handle, timer->queries, NULL);
    *timer = (struct vkb_timer){0};
}

bool vkb_timer_reserve(const struct vkb_device *device, uint32_t spans, struct vkb_timer *timer,
                       struct vkb_error *error)
{
    if (spans <= timer->capacity || device->timestamp_mask == 0)
        return true;
    vkb_timer_destroy(device, timer);
    if (!VK(error,
            device->vk.vkCreateQueryPool(device->handle,
                                         &(VkQueryPoolCreateInfo){
                                             .sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO,
                                             .queryType = VK_QUERY_TYPE_TIMESTAMP,
                                             .queryCount = 2 * spans,
                                         },
                                         NULL, &timer->queries)))
        return false;
    timer->capacity = spans;
    return true;
}

void vkb_timer_reset(const struct vkb_device *device, VkCommandBuffer commands,
                     const struct vkb_timer *timer)
{
    if (timer->queries)
        device->vk.vkCmdResetQueryPool(commands, timer->queries, 0, 2 * timer->capacity);
}

// Both ends at the bottom of the pipe: from the end of all that went before to the span's own end.
static void write_timestamp(const struct vkb_device *device, VkCommandBuffer commands,
                            const struct vkb_timer *timer, uint32_t query)
{
    if (timer->queries)
        device->vk.vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT,
                                       timer->queries, query);
}

void vkb_timer_start(const struct vkb_device *device, VkCommandBuffer commands,
                     const struct vkb_timer *timer, uint32_t span)
{
    write_timestamp(device, commands, timer, 2 * span);
}

void vkb_timer_stop(const struct vkb_device *device, VkCommandBuffer commands,
                    const struct vkb_timer *timer, uint32_t span)
{
    write_timestamp(device, commands, timer, 2 * span + 1);
}

bool vkb_timer_read(const struct vkb_device *device, const struct vkb_timer *timer, uint32_t span,
                    double *seconds, struct vkb_error *error)
{
    uint64_t stamps[2];

    *seconds = NAN;
    if (!timer->queries)
        return true;
    if (!VK(error, device->vk.vkGetQueryPoolResults(
                       device->handle, timer->queries, 2 * span, 2, sizeof stamps, stamps,
                       sizeof stamps[0], VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT)))
        return false;
    uint64_t ticks = (stamps[1] - stamps[0]) & device->timestamp_mask;
    *seconds = (double)ticks * device->limits.timestampPeriod * 1e-9;
    return true;
}
