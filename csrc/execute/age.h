// When cached objects are old enough to be destroyed. Age is counted in submissions, as
// libplacebo's dispatch.c counts frames.
#ifndef VKB_AGE_H
#define VKB_AGE_H

#include <stdbool.h>
#include <stdint.h>

// Objects that one of the last 64 submissions used are kept, however many there are. So a grid that
// returns to a size or method finds its objects in the cache.
enum { VKB_MIN_AGE = 64 };

struct vkb_age {
    uint64_t now;      // the number of the submission that is being recorded; the first is 1
    uint64_t pending;  // the first submission that the device may still run; `now`: none
};

// Whether an object that submission `used` used last is old enough, and no pending submission uses
// it.
static inline bool vkb_is_old(uint64_t used, const struct vkb_age *age)
{
    return used < age->pending && used + VKB_MIN_AGE <= age->now;
}

#endif
