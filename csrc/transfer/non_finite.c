#include "transfer/non_finite.h"

enum { COUNTED_AT_ONCE = 32768 };  // a sum of this many fits the 16-bit counters below

// Whether all halves are finite. If all bits of its exponent are set, a sum carries to the sign.
static bool are_finite_halves(const uint16_t *bits, size_t count)
{
    uint16_t sums = 0;

    for (size_t i = 0; i < count; ++i)
        sums |= (uint16_t)((bits[i] & 0x7c00) + 0x0400);
    return sums < 0x8000;
}

static struct vkb_non_finite count_halves(const uint16_t *bits, size_t count)
{
    // The counters have the width of the elements, so that compilers use vectors of this width.
    uint16_t non_finite = 0, infinite = 0;

    // Half the time of the count.
    if (are_finite_halves(bits, count))
        return (struct vkb_non_finite){0};
    for (size_t i = 0; i < count; ++i) {
        non_finite = (uint16_t)(non_finite + ((bits[i] & 0x7c00) == 0x7c00));
        infinite = (uint16_t)(infinite + ((bits[i] & 0x7fff) == 0x7c00));
    }
    return (struct vkb_non_finite){(uint64_t)(non_finite - infinite), infinite};
}

static bool are_finite_singles(const uint32_t *bits, size_t count)
{
    uint32_t sums = 0;

    for (size_t i = 0; i < count; ++i)
        sums |= (bits[i] & 0x7f800000) + 0x00800000;
    return sums < 0x80000000;
}

static struct vkb_non_finite count_singles(const uint32_t *bits, size_t count)
{
    uint32_t non_finite = 0, infinite = 0;

    if (are_finite_singles(bits, count))
        return (struct vkb_non_finite){0};
    for (size_t i = 0; i < count; ++i) {
        non_finite += (bits[i] & 0x7f800000) == 0x7f800000;
        infinite += (bits[i] & 0x7fffffff) == 0x7f800000;
    }
    return (struct vkb_non_finite){non_finite - infinite, infinite};
}

struct vkb_non_finite vkb_count_non_finite(enum vkb_format format, const void *values, size_t count)
{
    struct vkb_non_finite sum = {0};

    for (size_t i = 0; format != VKB_FORMAT_RGBA8_UNORM && i < count; i += COUNTED_AT_ONCE) {
        const size_t part = count - i < COUNTED_AT_ONCE ? count - i : COUNTED_AT_ONCE;
        const struct vkb_non_finite found = format == VKB_FORMAT_RGBA16_FLOAT
                                              ? count_halves((const uint16_t *)values + i, part)
                                              : count_singles((const uint32_t *)values + i, part);
        vkb_add_non_finite(&sum, found);
    }
    return sum;
}
