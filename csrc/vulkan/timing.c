#include "vulkan/timing.h"

#include <math.h>

void vkb_timer_destroy(const struct vkb_device *device, struct vkb_timer *timer)
{
    device->vk.vkDestroyQueryPool(device->handle, timer->queries, NULL);
    vkb_free(timer->stamps);
    *timer = (struct vkb_timer){0};
}

bool vkb_timer_reserve(const struct vkb_device *device, uint32_t count, struct vkb_timer *timer,
                       struct vkb_error *error)
{
    if (count <= timer->capacity || device->adapter.timestamp_mask == 0)
        return true;
    vkb_timer_destroy(device, timer);
    if (!(timer->stamps = vkb_alloc(error, count, sizeof *timer->stamps))
        || !VK(error,
               device->vk.vkCreateQueryPool(device->handle,
                                            &(VkQueryPoolCreateInfo){
                                                .sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO,
                                                .queryType = VK_QUERY_TYPE_TIMESTAMP,
                                                .queryCount = count,
                                            },
                                            NULL, &timer->queries)))
        return false;
    timer->capacity = count;
    return true;
}

void vkb_timer_reset(const struct vkb_device *device, VkCommandBuffer commands,
                     struct vkb_timer *timer)
{
    timer->count = 0;
    if (timer->queries)
        device->vk.vkCmdResetQueryPool(commands, timer->queries, 0, timer->capacity);
}

void vkb_timer_stamp(const struct vkb_device *device, VkCommandBuffer commands,
                     struct vkb_timer *timer)
{
    if (timer->queries)
        device->vk.vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT,
                                       timer->queries, timer->count);
    ++timer->count;
}

bool vkb_timer_fetch(const struct vkb_device *device, struct vkb_timer *timer,
                     struct vkb_error *error)
{
    const uint32_t count = timer->count;

    return !timer->queries || count == 0
        || VK(error, device->vk.vkGetQueryPoolResults(
                         device->handle, timer->queries, 0, count, count * sizeof *timer->stamps,
                         timer->stamps, sizeof *timer->stamps,
                         VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT));
}

double vkb_timer_seconds(const struct vkb_device *device, const struct vkb_timer *timer,
                         uint32_t first)
{
    if (!timer->queries)
        return NAN;
    uint64_t ticks =
        (timer->stamps[first + 1] - timer->stamps[first]) & device->adapter.timestamp_mask;
    return (double)ticks * device->limits.timestampPeriod * 1e-9;
}
