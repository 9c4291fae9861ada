// A flight: one submission with all that its commands use until the device has run them. Several
// can be in the air at once, so that the device works on one while the host reads another.
#ifndef VKB_FLIGHT_H
#define VKB_FLIGHT_H

#include "run/readback.h"
#include "vulkan/commands.h"
#include "vulkan/timing.h"

struct vkb_flight {
    struct vkb_commands commands;
    struct vkb_buffer uniforms;
    VkDeviceSize uniform_used;
    VkDescriptorPool descriptors;
    uint32_t descriptor_capacity;  // in sets
    struct vkb_timer timer;
    struct vkb_readback readback;
    uint64_t number;               // of the submission; they count up
    struct vkb_request *requests;  // what it runs; the submitter's
    uint32_t request_count;
    bool taken;     // by a submitter that has not given it back
    bool airborne;  // the device may still be at work on it, also where nobody waits any more
};

struct vkb_flights {
    struct vkb_flight **flights;  // pointers, so that they stay where they are
    size_t count, capacity;
};

// Destroys all flights, those taken too. After vkb_flights_end, where some were submitted.
void vkb_flights_destroy(const struct vkb_device *device, struct vkb_flights *flights);

// A flight that nobody uses, ready for vkb_commands_begin.
bool vkb_flights_take(const struct vkb_device *device, struct vkb_flights *flights,
                      struct vkb_flight **flight, struct vkb_error *error);
// One that is in the air can be taken again when it has landed.
void vkb_flights_give_back(const struct vkb_device *device, struct vkb_flights *flights,
                           struct vkb_flight *flight);

// The number of the first submission in the air; `now` where there is none.
uint64_t vkb_flights_pending(const struct vkb_flights *flights, uint64_t now);

// Whether the device has run the flight, without a wait.
bool vkb_flight_over(const struct vkb_device *device, const struct vkb_flight *flight);

// Ends the recording and hands it to the device.
bool vkb_flight_submit(struct vkb_device *device, struct vkb_flight *flight,
                       struct vkb_error *error);
// Waits until the device has run the flight, whatever is before it included. On failure it is still
// in the air.
bool vkb_flight_wait(struct vkb_device *device, const struct vkb_flights *flights,
                     struct vkb_flight *flight, struct vkb_error *error);

// Waits for all that is in the air: what flights share can be changed by the host after this.
bool vkb_flights_land(struct vkb_device *device, struct vkb_flights *flights,
                      struct vkb_error *error);

// The same for the last time, also on a lost device: false where what flights use cannot be
// destroyed, because the device may still be at work on it.
bool vkb_flights_end(struct vkb_device *device, struct vkb_flights *flights,
                     struct vkb_error *error);

#endif
