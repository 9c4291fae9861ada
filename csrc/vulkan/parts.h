// Work on the rows of an image by several threads.
#ifndef VKB_PARTS_H
#define VKB_PARTS_H

#include "vulkan/error.h"

#include <stddef.h>
#include <stdint.h>

enum { VKB_MAX_PARTS = 16 };

// The processor's cores that this process may use.
uint32_t vkb_core_count(void);

// Does the rows `first` to `end` (excluded). `part` is below VKB_MAX_PARTS, and no two calls at the
// same time have the same one.
typedef void vkb_rows(void *context, uint32_t part, uint32_t first, uint32_t end);
// The rows before `end` are done.
typedef void vkb_rows_done(void *context, uint32_t end);

// Threads that wait for work, so that threads are not started for each image. They are started by
// the first call that needs them. Calls with one object must not overlap.
struct vkb_workers;

struct vkb_workers *vkb_workers_create(struct vkb_error *error);
// `workers` may be NULL.
void vkb_workers_destroy(struct vkb_workers *workers);

// Divides the rows `first` to `end` between the processor's cores, if their `size` in bytes is
// large enough, and returns when all are done. Rows are started in order. `done` may be NULL. It is
// called in the caller's thread while the other threads continue, and finally with `end`. If a
// thread cannot be started, the others do its part. The threads receive no signals.
void vkb_in_parts(struct vkb_workers *workers, vkb_rows *rows, vkb_rows_done *done, void *context,
                  uint32_t first, uint32_t end, size_t size);

#endif
