#include "vulkan/timing.h"

#include <math.h>

void vkb_timer_destroy(const struct vkb_device *device, struct vkb_timer *timer)
{
    device->vk.vkDestroyQueryPool(device->handle, timer->queries, NULL);
    vkb_free(timer->stamps);
    *timer = (struct vkb_timer){0};
}

bool vkb_timer_reserve(const struct vkb_device *device, uint32_t spans, struct vkb_timer *timer,
                       struct vkb_error *error)
{
    if (spans <= timer->capacity || device->adapter.timestamp_mask == 0)
        return true;
    vkb_timer_destroy(device, timer);
    if (!(timer->stamps = vkb_alloc(error, (size_t)2 * spans, sizeof *timer->stamps))
        || !VK(error,
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
                     struct vkb_timer *timer)
{
    timer->span_count = 0;
    if (timer->queries)
        device->vk.vkCmdResetQueryPool(commands, timer->queries, 0, 2 * timer->capacity);
}

// Both timestamps are at the bottom of the pipe: from the end of all earlier work to the end of the
// span.
static void write_timestamp(const struct vkb_device *device, VkCommandBuffer commands,
                            const struct vkb_timer *timer, uint32_t query)
{
    if (timer->queries)
        device->vk.vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT,
                                       timer->queries, query);
}

void vkb_timer_start(const struct vkb_device *device, VkCommandBuffer commands,
                     const struct vkb_timer *timer)
{
    write_timestamp(device, commands, timer, 2 * timer->span_count);
}

void vkb_timer_stop(const struct vkb_device *device, VkCommandBuffer commands,
                    struct vkb_timer *timer)
{
    write_timestamp(device, commands, timer, 2 * timer->span_count + 1);
    ++timer->span_count;
}

bool vkb_timer_fetch(const struct vkb_device *device, struct vkb_timer *timer,
                     struct vkb_error *error)
{
    const uint32_t count = 2 * timer->span_count;

    return !timer->queries || count == 0
        || VK(error, device->vk.vkGetQueryPoolResults(
                         device->handle, timer->queries, 0, count, count * sizeof *timer->stamps,
                         timer->stamps, sizeof *timer->stamps,
                         VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT));
}

double vkb_timer_seconds(const struct vkb_device *device, const struct vkb_timer *timer,
                         uint32_t span)
{
    if (!timer->queries)
        return NAN;
    uint64_t ticks =
        (timer->stamps[2 * span + 1] - timer->stamps[2 * span]) & device->adapter.timestamp_mask;
    return (double)ticks * device->limits.timestampPeriod * 1e-9;
}
