// When what is cached may go: counted in submissions, as libplacebo's dispatch.c counts frames.
#ifndef VKB_AGE_H
#define VKB_AGE_H

#include <stdbool.h>
#include <stdint.h>

// What was used by one of this many submissions before is kept, however much there is: a grid that
// comes back to a few sizes or methods finds them there.
enum { VKB_LEAST_AGE = 64 };

struct vkb_age {
    uint64_t now;      // the number of the submission that is being recorded; the first is 1
    uint64_t pending;  // of the first one that the device may still be at work on; `now`: none
};

// Whether what submission `used` used last is old enough, and no pending submission can use it.
static inline bool vkb_is_old(uint64_t used, const struct vkb_age *age)
{
    return used < age->pending && used + VKB_LEAST_AGE <= age->now;
}

#endif
