// Memory that replaced images have left, which new images take. An allocation takes longer than a
// pass. Training steps over ten sizes in turn, around 3800 x 2000 (H200, 2026-11-29): 29 and 67 ms
// a step with new memory for Pyramid and "kino", 3.5 and 5.2 with this; 2.9 and 4.5 if the size
// stays.
#ifndef VKB_SPARES_H
#define VKB_SPARES_H

#include "vulkan/device.h"

struct vkb_spare {
    VkDeviceMemory memory;
    void *host;  // what was allocated for memory of the host's; NULL: the device's
    VkDeviceSize size;
    uint32_t type;  // of memory
    uint64_t used;  // the last submission that used it
};

struct vkb_spares {
    struct vkb_spare *spares;
    size_t count, capacity;
    uint64_t size;    // of all together
    uint64_t missed;  // how often none fitted
};

// Frees memory that is counted in device->allocations, and what of the host's it is. Both may be
// null.
void vkb_memory_free(const struct vkb_device *device, VkDeviceMemory memory, void *host);

// False: there is no room for another one, which stays the caller's.
bool vkb_spares_add(struct vkb_spares *spares, const struct vkb_spare *spare);

// Takes the smallest of a type, of the host's memory or not, that has at least `size` bytes and not
// many times as many. `spares` may be NULL. False: there is none.
bool vkb_spares_take(struct vkb_spares *spares, uint32_t type, bool host, VkDeviceSize size,
                     struct vkb_spare *taken);

// The one that was used first; NULL: there is none.
struct vkb_spare *vkb_spares_oldest(const struct vkb_spares *spares);

void vkb_spares_free_one(const struct vkb_device *device, struct vkb_spares *spares,
                         struct vkb_spare *spare);
// Frees all, which can be used on.
void vkb_spares_free(const struct vkb_device *device, struct vkb_spares *spares);

#endif
