// The loops of passes on the host, which are compiled for vectors of 4 and of 8 floats. All have
// the same bits: what is added up stays in one lane, and products and sums are rounded one by one.
#ifndef VKB_HOST_LOOPS_H
#define VKB_HOST_LOOPS_H

#include "vulkan/parts.h"

// Functions for vkb_in_parts. The rows of transforms (host_fft.h) are blocks: of four rows, of
// 2 * `lanes` rows of a kernel, or of `lanes` columns of a channel. Those of sun beams
// (host_beams.h) are tiles.
struct vkb_host_loops {
    uint32_t lanes;
    vkb_rows *rows_forth, *kernel_rows, *columns, *rows_back, *beams;
    vkb_rows *ghosts;  // of rows; NULL: there are no conversions of half floats
};
extern const struct vkb_host_loops vkb_host_loops_4;
#if defined __x86_64__
extern const struct vkb_host_loops vkb_host_loops_8;
#endif

// Those for the widest vectors that the processor has.
static inline const struct vkb_host_loops *vkb_host_loops(void)
{
#if defined __x86_64__
    if (__builtin_cpu_supports("avx2"))
        return &vkb_host_loops_8;
#endif
    return &vkb_host_loops_4;
}

#endif
