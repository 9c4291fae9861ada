// The device's time for each render pass, by timestamp queries.
#ifndef VKB_TIMING_H
#define VKB_TIMING_H

#include "vulkan/device.h"

struct vkb_timer {
    VkQueryPool queries;  // VK_NULL_HANDLE if the queue has no timestamps
    uint64_t *stamps;     // results of vkb_timer_fetch
    uint32_t capacity;
    uint32_t count;  // recorded since the last reset
};

void vkb_timer_destroy(const struct vkb_device *device, struct vkb_timer *timer);

// Makes room for so many timestamps. No recorded commands may use the timer.
bool vkb_timer_reserve(const struct vkb_device *device, uint32_t count, struct vkb_timer *timer,
                       struct vkb_error *error);

// Record the reset, then the next timestamp: the end of all earlier work.
void vkb_timer_reset(const struct vkb_device *device, VkCommandBuffer commands,
                     struct vkb_timer *timer);
void vkb_timer_stamp(const struct vkb_device *device, VkCommandBuffer commands,
                     struct vkb_timer *timer);

// After the commands have run: reads the timestamps for vkb_timer_seconds.
bool vkb_timer_fetch(const struct vkb_device *device, struct vkb_timer *timer,
                     struct vkb_error *error);
// The time from a timestamp to the next one; NaN without timestamps.
double vkb_timer_seconds(const struct vkb_device *device, const struct vkb_timer *timer,
                         uint32_t first);

#endif
