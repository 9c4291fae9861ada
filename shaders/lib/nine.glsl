// What the directions and the variants of blurs of nine taps share. For shaders with PREFILTER_BLOCK.
#include "lib/points.glsl"

const bool IS_GODOT = TAP_SET == TAPS_GODOT, HAS_POINT_AFTER = POINT_AFTER != POINT_NONE;
const int NINE_RADIUS = 4;

#define LINE_WEIGHT(name, value, half_kernel) \
    if (TAP_SET == name) \
        return float[](half_kernel)[abs(tap)];

float nine_weight(int tap)
{
    LINE_SETS(LINE_WEIGHT)
    return 0.0;
}

// The position from which a sample is read: samples are clamped in pairs.
int paired(int place, int length)
{
    int pair = clamp(place & ~1, 0, max(length - 2, 0));
    return min(pair + (place & 1), length - 1);
}
