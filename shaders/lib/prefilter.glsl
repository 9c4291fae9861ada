// What a pass makes of its taps: a choice of the tables of params.h. For shaders with PREFILTER_BLOCK.
#include "lib/points.glsl"
#include "lib/combine.glsl"

// Numbers of taps and kernels of the pass's set. Macros of tables expand to conditions of one constant each: glslang 12
// writes invalid SPIR-V for a condition of several.
#define COUNT_TAP(number, x, y) +1
#define COUNT_KERNEL(number, share, a, b, c, d) +1
#define SET_TAP_COUNT(name, value, ROWS, KERNELS, PLACE, SHARE) \
    if (TAP_SET == name) \
        return 0 ROWS(COUNT_TAP);
#define SET_FOUR_COUNT(name, value, ROWS, KERNELS, PLACE, SHARE) \
    if (TAP_SET == name) \
        return 0 KERNELS(COUNT_KERNEL);

int tap_count()
{
    TAP_SETS(SET_TAP_COUNT)
    return 1;
}

// Kernels of four taps; 0: each tap is a kernel.
int four_count()
{
    TAP_SETS(SET_FOUR_COUNT)
    return 0;
}

int kernel_count()
{
    return four_count() > 0 ? four_count() : tap_count();
}

// Whether the combination is a mean of the samples themselves, which is linear; else whether its cotangents are those of
// taps, not of kernels.
bool is_mean()
{
    if (POINT_BEFORE != POINT_NONE)
        return false;
    return COMBINE == COMBINE_MEAN;
}

bool by_taps()
{
    if (POINT_BEFORE != POINT_NONE)
        return true;
    return weighs_taps() || four_count() == 0;
}

// The numbers of a tap's places along both axes, from -MAX_PLACE to MAX_PLACE.
#define TAP_NUMBERS(number, x, y) tap == number ? ivec2(x, y) :
#define SET_NUMBERS(name, value, ROWS, KERNELS, PLACE, SHARE) \
    if (TAP_SET == name) \
        return ROWS(TAP_NUMBERS) ivec2(0);

ivec2 numbers_of(int tap)
{
    TAP_SETS(SET_NUMBERS)
    return ivec2(0);
}

// Where a place is along an axis, in texels, and its factor of a share, for a position this part of a texel after one.
#define SET_PLACE(name, value, ROWS, KERNELS, PLACE, SHARE) \
    if (TAP_SET == name) \
        return float(PLACE(at, part));
#define SET_SHARE(name, value, ROWS, KERNELS, PLACE, SHARE) \
    if (TAP_SET == name) \
        return SHARE(at, part);

float place_along(int at, float part)
{
    TAP_SETS(SET_PLACE)
    return 0.0;
}

float share_along(int at, float part)
{
    TAP_SETS(SET_SHARE)
    return 1.0;
}

// Whether places are texels apart.
bool are_texels()
{
    return place_along(1, 0.25) == 1.0;
}

vec2 place_of(int tap, vec2 part)
{
    ivec2 at = numbers_of(tap);
    return vec2(place_along(at.x, part.x), place_along(at.y, part.y));
}

float share_of(int tap, vec2 part)
{
    ivec2 at = numbers_of(tap);
    return share_along(at.x, part.x) * share_along(at.y, part.y);
}

// Makes the kernels of four taps. (Numbers of taps are written out: an index that depends on a specialization constant
// keeps compilers from making variables of an array.)
#define MAKE_KERNEL(number, share, a, b, c, d) \
    samples.kernels[number] = \
        kernel_of(vec4[](samples.taps[a], samples.taps[b], samples.taps[c], samples.taps[d]), samples.weights[number]); \
    samples.shares[number] = share;
#define MAKE_SET_KERNELS(name, value, ROWS, KERNELS, PLACE, SHARE) \
    if (TAP_SET == name) { \
        KERNELS(MAKE_KERNEL) \
    }

// The taps after the point function of samples, and their kernels.
Samples samples_of(vec4 taps[MAX_SET_TAPS], vec2 part)
{
    Samples samples;
    [[unroll]] for (int i = 0; i < MAX_SET_TAPS; ++i)
        samples.taps[i] = i < tap_count() ? apply_point(POINT_BEFORE, taps[i]) : vec4(0.0);
    [[unroll]] for (int i = 0; i < MAX_SET_KERNELS; ++i) {
        samples.kernels[i] = samples.taps[i];
        samples.shares[i] = share_of(i, part);
        samples.weights[i] = 1.0;
    }
    TAP_SETS(MAKE_SET_KERNELS)
    return samples;
}

// What the pass makes of its taps.
vec4 prefiltered(vec4 taps[MAX_SET_TAPS], vec2 part)
{
    return apply_point(POINT_AFTER, combined(samples_of(taps, part), kernel_count()));
}
