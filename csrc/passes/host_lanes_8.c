// Vectors of AVX2, without fused products and sums: the bits are those of host_lanes_4.c. All
// processors with AVX2 convert half floats, too.
#if defined __x86_64__
// Before the target of what follows: its functions have their own.
#include <immintrin.h>
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2,f16c"))), apply_to = function)
#else
#pragma GCC target("avx2,f16c")
#endif
#define LANES 8
#define LOOPS vkb_host_loops_8
#include "passes/host_lanes.h"
#ifdef __clang__
#pragma clang attribute pop
#endif
#else
typedef int vkb_no_lanes_of_8;
#endif
