// The device's time for each render pass, by timestamp queries.
#ifndef VKB_TIMING_H
#define VKB_TIMING_H

#include "vulkan/device.h"

struct vkb_timer {
    VkQueryPool queries;  // VK_NULL_HANDLE if the queue has no timestamps
    uint64_t *stamps;     // results of vkb_timer_fetch
    uint32_t capacity;    // in spans of two timestamps
    uint32_t span_count;  // recorded since the last reset
};

void vkb_timer_destroy(const struct vkb_device *device, struct vkb_timer *timer);

// Makes room for `spans` spans. No recorded commands may use the timer.
bool vkb_timer_reserve(const struct vkb_device *device, uint32_t spans, struct vkb_timer *timer,
                       struct vkb_error *error);

// Record the reset, then the start and the end of each span. Spans count from 0.
void vkb_timer_reset(const struct vkb_device *device, VkCommandBuffer commands,
                     struct vkb_timer *timer);
void vkb_timer_start(const struct vkb_device *device, VkCommandBuffer commands,
                     const struct vkb_timer *timer);
void vkb_timer_stop(const struct vkb_device *device, VkCommandBuffer commands,
                    struct vkb_timer *timer);

// After the commands have run: reads the timestamps for vkb_timer_seconds.
bool vkb_timer_fetch(const struct vkb_device *device, struct vkb_timer *timer,
                     struct vkb_error *error);
// The duration of a span; NaN without timestamps.
double vkb_timer_seconds(const struct vkb_device *device, const struct vkb_timer *timer,
                         uint32_t span);

#endif
