#include "vulkan/spares.h"

void vkb_memory_free(const struct vkb_device *device, VkDeviceMemory memory, void *host)
{
    device->vk.vkFreeMemory(device->handle, memory, NULL);
    vkb_free(host);
    if (memory)
        atomic_fetch_sub(device->allocations, 1);
}

bool vkb_spares_add(struct vkb_spares *spares, const struct vkb_spare *spare)
{
    struct vkb_error ignored;

    if (!vkb_grow(&ignored, &spares->spares, &spares->capacity, spares->count + 1, sizeof *spare))
        return false;
    spares->spares[spares->count++] = *spare;
    spares->size += spare->size;
    return true;
}

static void remove_spare(struct vkb_spares *spares, struct vkb_spare *spare)
{
    spares->size -= spare->size;
    *spare = spares->spares[--spares->count];
}

// Frames of many sizes in turn share the memory of the largest. Small images do not hold that of
// one that is much larger.
enum { MAX_RATIO = 8 };

bool vkb_spares_take(struct vkb_spares *spares, uint32_t type, bool host, VkDeviceSize size,
                     struct vkb_spare *taken)
{
    struct vkb_spare *best = NULL;

    for (size_t i = 0; spares && i < spares->count; ++i) {
        struct vkb_spare *spare = &spares->spares[i];
        if (spare->type == type && (spare->host != NULL) == host && spare->size >= size
            && spare->size / MAX_RATIO <= size && (!best || spare->size < best->size))
            best = spare;
    }
    if (!best) {
        if (spares)
            ++spares->missed;
        return false;
    }
    *taken = *best;
    remove_spare(spares, best);
    return true;
}

struct vkb_spare *vkb_spares_oldest(const struct vkb_spares *spares)
{
    struct vkb_spare *oldest = NULL;

    for (size_t i = 0; i < spares->count; ++i)
        if (!oldest || spares->spares[i].used < oldest->used)
            oldest = &spares->spares[i];
    return oldest;
}

void vkb_spares_free_one(const struct vkb_device *device, struct vkb_spares *spares,
                         struct vkb_spare *spare)
{
    vkb_memory_free(device, spare->memory, spare->host);
    remove_spare(spares, spare);
}

void vkb_spares_free(const struct vkb_device *device, struct vkb_spares *spares)
{
    for (size_t i = 0; i < spares->count; ++i)
        vkb_memory_free(device, spares->spares[i].memory, spares->spares[i].host);
    vkb_free(spares->spares);
    *spares = (struct vkb_spares){.missed = spares->missed};
}
