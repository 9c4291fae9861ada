// Host memory of large arrays, used again when an array is gone: the system gives new memory page
// by page and zeroes it, and a device pins it anew, which takes several times as long as the
// transfer. The calls must not overlap; the core makes them with the GIL.
#ifndef VKB_PAGES_H
#define VKB_PAGES_H

#include "vulkan/memory.h"

// A run of pages. Somebody has it or it is idle.
struct vkb_page_run {
    struct vkb_page_run *previous, *next;  // in its list
    void *start;                           // of what was allocated
    void *memory;
    size_t size;
    struct vkb_buffer buffer;  // over all of it, from its first use by the device on
};

struct vkb_pages;

struct vkb_pages *vkb_pages_create(const struct vkb_device *device, struct vkb_error *error);
// Before the device goes, which must be done with all of them: what is idle is freed, what somebody
// has is no buffer any more and stays until it is given back. May be NULL.
void vkb_pages_close(struct vkb_pages *pages);

// At least `size` bytes, aligned so that they can become a buffer. They hold anything.
struct vkb_page_run *vkb_pages_take(struct vkb_pages *pages, size_t size, struct vkb_error *error);
// The device must be done with it.
void vkb_pages_give_back(struct vkb_pages *pages, struct vkb_page_run *run);
// Those that somebody has and that the memory is in; NULL: none.
struct vkb_page_run *vkb_pages_find(const struct vkb_pages *pages, const void *memory);

#endif
