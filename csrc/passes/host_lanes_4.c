// Vectors that every 64-bit processor has.
#define LANES 4
#define LOOPS vkb_host_loops_4
#include "passes/host_lanes.h"
