// The filter of each level that is gathered: one tap with one kernel.
#define FILTER_X(i) vec4(0.0, 1.0, 0.0, 0.0)
#define FILTER_Y(i) vec4(0.0, 1.0, 0.0, 0.0)
#include "lib/filter.glsl"
