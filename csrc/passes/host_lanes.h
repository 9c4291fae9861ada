// The loops of passes on the host, for vectors of LANES floats. Include this once, after LANES and
// LOOPS, the name of the table of functions.
#include "passes/host_loops.h"

#include <string.h>

#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#endif

#define INLINE static inline __attribute__((always_inline))

typedef float lanes __attribute__((vector_size(LANES * sizeof(float))));
typedef float pixel __attribute__((vector_size(4 * sizeof(float))));
typedef int32_t lane_bits __attribute__((vector_size(LANES * sizeof(int32_t))));

INLINE uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

INLINE uint32_t clamped(int32_t place, uint32_t size)
{
    return place < 0 ? 0 : least((uint32_t)place, size - 1);
}

// The bits of a number whose size is at most `limit`, as limited() has them in storage.glsl.
INLINE lane_bits limit_bits(lane_bits bits, float limit)
{
    int32_t most;

    memcpy(&most, &limit, sizeof most);
    const lane_bits size = bits & 0x7fffffff, over = size > most;
    return (size & ~over) | (most & over) | (bits & INT32_MIN);
}

INLINE void clean(lanes *value, bool finite, float limit)
{
    lane_bits bits;

    memcpy(&bits, value, sizeof bits);
    if (finite)
        bits &= (bits & 0x7f800000) != 0x7f800000;
    bits = limit_bits(bits, limit);
    memcpy(value, &bits, sizeof bits);
}

#include "passes/host_beam_lanes.h"
#include "passes/host_fft_lanes.h"
#if LANES == 8
#include "passes/host_ghost_lanes.h"
#define GHOSTS ghosts
#else
#define GHOSTS NULL
#endif

const struct vkb_host_loops LOOPS = {LANES,     rows_forth, kernel_rows, columns,
                                     rows_back, beams,      GHOSTS};
