// NaN and infinity among the values of an image.
#ifndef VKB_NON_FINITE_H
#define VKB_NON_FINITE_H

#include "vulkan/format.h"

#include <stddef.h>

struct vkb_non_finite {
    uint64_t nan, inf;
};

// Counts them among `count` channels of that format, which lie at a multiple of their size.
struct vkb_non_finite vkb_count_non_finite(enum vkb_format format, const void *values,
                                           size_t count);

static inline void vkb_add_non_finite(struct vkb_non_finite *sum, struct vkb_non_finite added)
{
    sum->nan += added.nan;
    sum->inf += added.inf;
}

#endif
