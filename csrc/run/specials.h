// NaN and infinity among the values of an image.
#ifndef VKB_SPECIALS_H
#define VKB_SPECIALS_H

#include "vulkan/format.h"

#include <stddef.h>

struct vkb_specials {
    uint64_t nan, inf;
};

// Counts them among `count` channels of that format, which lie at a multiple of their size.
struct vkb_specials vkb_count_specials(enum vkb_format format, const void *values, size_t count);

static inline void vkb_add_specials(struct vkb_specials *sum, struct vkb_specials added)
{
    sum->nan += added.nan;
    sum->inf += added.inf;
}

#endif
