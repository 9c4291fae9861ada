// Host memory of large arrays, kept for new arrays when an array is freed. New memory is slow: the
// system maps and zeroes it page by page, and the device pins it, which takes several times as long
// as the transfer. Calls must not overlap; the core makes them with the GIL or vkb_memory.
#ifndef VKB_PAGES_H
#define VKB_PAGES_H

#include "vulkan/memory.h"

// A run of pages: taken by an array, or idle.
struct vkb_page_run {
    struct vkb_page_run *previous, *next;  // in the list of taken or idle runs
    void *start;                           // of the allocation
    void *memory;
    size_t size;
    struct vkb_buffer buffer;  // over the complete run; created when the device first uses it
};

struct vkb_pages;

struct vkb_pages *vkb_pages_create(const struct vkb_device *device, struct vkb_error *error);
// Must be called before the device is destroyed, and when it has finished all work on the runs.
// Frees the idle runs and destroys the buffers of the others, which stay until they are given back.
// `pages` may be NULL.
void vkb_pages_close(struct vkb_pages *pages);

// Takes at least `size` bytes, aligned for the import as a buffer. Their content is undefined.
struct vkb_page_run *vkb_pages_take(struct vkb_pages *pages, size_t size, struct vkb_error *error);
// The device must have finished all work on the run.
void vkb_pages_give_back(struct vkb_pages *pages, struct vkb_page_run *run);
// The taken run that contains the memory; NULL: none.
struct vkb_page_run *vkb_pages_find(const struct vkb_pages *pages, const void *memory);

#endif
