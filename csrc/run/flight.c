#include "run/flight.h"

enum { KEPT_FLIGHTS = 3 };  // that nobody uses; more were needed by more threads at once

static void destroy_flight(const struct vkb_device *device, struct vkb_flight *flight)
{
    vkb_timer_destroy(device, &flight->timer);
    device->vk.vkDestroyDescriptorPool(device->handle, flight->descriptors, NULL);
    vkb_buffer_destroy(device, &flight->uniforms);
    vkb_readback_destroy(device, &flight->readback);
    vkb_commands_destroy(device, &flight->commands);
    vkb_free(flight);
}

void vkb_flights_destroy(const struct vkb_device *device, struct vkb_flights *flights)
{
    for (size_t i = 0; i < flights->count; ++i)
        destroy_flight(device, flights->flights[i]);
    vkb_free(flights->flights);
    *flights = (struct vkb_flights){0};
}

static struct vkb_flight *find_free(const struct vkb_flights *flights)
{
    for (size_t i = 0; i < flights->count; ++i)
        if (!flights->flights[i]->taken && !flights->flights[i]->airborne)
            return flights->flights[i];
    return NULL;
}

static struct vkb_flight *add_flight(struct vkb_flights *flights, struct vkb_error *error)
{
    struct vkb_flight *flight;

    if (!vkb_grow(error, &flights->flights, &flights->capacity, flights->count + 1,
                  sizeof(struct vkb_flight *))
        || !(flight = vkb_alloc(error, 1, sizeof *flight)))
        return NULL;
    flights->flights[flights->count++] = flight;
    return flight;
}

bool vkb_flights_take(const struct vkb_device *device, struct vkb_flights *flights,
                      struct vkb_flight **taken, struct vkb_error *error)
{
    struct vkb_flight *flight = find_free(flights);

    if (!flight && !(flight = add_flight(flights, error)))
        return false;
    if (!flight->commands.pool && !vkb_commands_create(device, &flight->commands, error))
        return false;
    flight->taken = true;
    flight->uniform_used = 0;
    *taken = flight;
    return true;
}

void vkb_flights_give_back(const struct vkb_device *device, struct vkb_flights *flights,
                           struct vkb_flight *flight)
{
    size_t free_count = 0;

    flight->taken = false;
    flight->requests = NULL;
    if (flight->airborne)
        return;
    flight->request_count = 0;
    vkb_readback_release(device, &flight->readback);
    for (size_t i = 0; i < flights->count; ++i)
        free_count += !flights->flights[i]->taken;
    if (free_count <= KEPT_FLIGHTS)
        return;
    for (size_t i = 0; i < flights->count; ++i)
        if (flights->flights[i] == flight)
            flights->flights[i] = flights->flights[--flights->count];
    destroy_flight(device, flight);
}

bool vkb_flight_submit(struct vkb_device *device, struct vkb_flight *flight,
                       struct vkb_error *error)
{
    flight->airborne = vkb_commands_submit(device, &flight->commands, error);
    return flight->airborne;
}

uint64_t vkb_flights_pending(const struct vkb_flights *flights, uint64_t now)
{
    uint64_t first = now;

    for (size_t i = 0; i < flights->count; ++i)
        if (flights->flights[i]->airborne && flights->flights[i]->number < first)
            first = flights->flights[i]->number;
    return first;
}

bool vkb_flight_over(const struct vkb_device *device, const struct vkb_flight *flight)
{
    return !flight->airborne || vkb_commands_over(device, &flight->commands);
}

// All that is in the air may come before the flight; one without requests loads a scene.
static uint32_t count_frames(const struct vkb_flights *flights)
{
    uint32_t count = 0;

    for (size_t i = 0; i < flights->count; ++i)
        if (flights->flights[i]->airborne)
            count += flights->flights[i]->request_count ? flights->flights[i]->request_count : 1;
    return count;
}

bool vkb_flight_wait(struct vkb_device *device, const struct vkb_flights *flights,
                     struct vkb_flight *flight, struct vkb_error *error)
{
    if (flight->airborne
        && !vkb_commands_wait(device, &flight->commands, count_frames(flights), error))
        return false;
    flight->airborne = false;
    return true;
}

bool vkb_flights_land(struct vkb_device *device, struct vkb_flights *flights,
                      struct vkb_error *error)
{
    for (size_t i = 0; i < flights->count; ++i)
        if (!vkb_flight_wait(device, flights, flights->flights[i], error))
            return false;
    return true;
}

bool vkb_flights_end(struct vkb_device *device, struct vkb_flights *flights,
                     struct vkb_error *error)
{
    for (size_t i = 0; i < flights->count; ++i) {
        struct vkb_flight *flight = flights->flights[i];
        if (vkb_flight_wait(device, flights, flight, error))
            continue;
        if (error->kind == VKB_ERROR_INTERRUPTED || error->result == VK_TIMEOUT)
            return false;
        // A wait for which there was no memory tells nothing; one that says twice that the device
        // is lost does, and what is on a lost device can be destroyed.
        if (!vkb_flight_wait(device, flights, flight, error)
            && error->result != VK_ERROR_DEVICE_LOST)
            return false;
    }
    return true;
}
