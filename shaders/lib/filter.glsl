// A filter along both axes as data: taps at distances from the position of a pixel, in texels, each with
// a weight for up to three kernels. A kernel is a sum along rows, then along columns; the kernels are
// added up. UPSAMPLE is what a tap samples there. The taps and kernels are TAP_COUNT and KERNELS in number.
//
// All variants of a filter add the WINDOW texels around a position in the same order, for each kernel by
// itself: one sum of all has a quarter more error. Texels without a weight at any position (has_weight) may be
// left out, which changes no bits. Include sampling.glsl before this file. The including shader has FILTER_ROWS
// in its block, or defines FILTER_X(i) and FILTER_Y(i), the tap of number i along an axis: offset and weights.

#include "lib/window.glsl"

#ifndef FILTER_X
#define FILTER_X(i) params.taps_x[i]
#define FILTER_Y(i) params.taps_y[i]
#endif

// A position along one axis of an image: a texel, and the offset from its centre; the size of the image
// along this axis, and its ratio to the target's.
struct Axis {
    int texel;
    float part;
    int size;
    float ratio;
};

// Sides of the source and of the target that give the positions of pixels. In a simple ratio (EXACT) these are the
// ratio alone, since the target of a moved filter may reach beyond the image.
ivec2 sides_of(int ratio, int size, int target_size)
{
    if (ratio == 0)
        return ivec2(size, target_size);
    return ivec2(ratio == EXACT_HALF ? 2 : 1, ratio == EXACT_DOUBLE ? 2 : 1);
}

Place position_of(ivec2 size, ivec2 pixel, ivec2 target_size)
{
    ivec2 x = sides_of(EXACT, size.x, target_size.x), y = sides_of(EXACT_ROWS, size.y, target_size.y);
    return place_in_size(ivec2(x.x, y.x), pixel, ivec2(x.y, y.y));
}

// Along x for 0, along y for 1.
Axis axis_of(Place place, ivec2 size, vec2 ratio, int along)
{
    return Axis(place.texel[along], place.part[along], size[along], ratio[along]);
}

const bool IS_INSET = UPSAMPLE == UPSAMPLE_INSET_LINEAR || UPSAMPLE == UPSAMPLE_INSET_CUBIC;

// HDRP's border: no position is beyond the middle of the last two texels.
Axis within_border(Axis axis)
{
    if (IS_INSET)
        axis.part = min(axis.part, float(axis.size - axis.texel) - 1.5);
    return axis;
}

// The same, from the texel at or before the position on.
Axis settled(Axis axis)
{
    axis = within_border(axis);
    int moved = int(floor(axis.part));
    return Axis(axis.texel + moved, axis.part - float(moved), axis.size, axis.ratio);
}

// The weights of a cubic B-spline whose control points are the texels.
vec4 cubic_weights(float part)
{
    float rest = 1.0 - part;
    return vec4(rest * rest * rest, 4.0 - 3.0 * part * part * (2.0 - part),
                4.0 - 3.0 * rest * rest * (2.0 - rest), part * part * part) / 6.0;
}

// Adds a linear sample this far from the texel that has `before` ones before it.
void add_sample(inout Window window, int count, int before, float place, vec3 weights)
{
    float integer = floor(place), part = place - integer;
    int at = before + int(integer);
    [[unroll]] for (int i = 0; i < count; ++i)
        window.weights[i] += i == at     ? (1.0 - part) * weights
                           : i == at + 1 ? part * weights
                                         : vec3(0.0);
}

// One of the two linear taps of a cubic filter, neither of them further from the texel than 1 - 1 / size of
// the target (Sigg and Hadwiger, "Fast Third-Order Texture Filtering", GPU Gems 2, chapter 20).
void add_inset_cubic(inout Window window, int count, int before, Axis axis, vec4 tap)
{
    float integer = floor(axis.part);
    float furthest = float(axis.size - 1 - axis.texel) + 0.5 - axis.ratio - integer;
    vec4 cubic = cubic_weights(axis.part - integer);
    vec2 weights = tap.x < 0.0 ? cubic.xy : cubic.zw;
    float weight = weights.x + weights.y;
    add_sample(window, count, before + int(integer), min(weights.y / weight + tap.x, furthest),
               weight * tap.yzw);
}

// Whether a tap's position is in the image; the tap in the middle always counts (pmndrs/postprocessing
// @ 69c61a640078, downsampling of MipmapBlurPass). Positions on the border are exact but for roundings.
bool is_inside(Axis axis, float offset)
{
    float place = float(axis.texel) + axis.part + offset, reach = float(axis.size) - 0.5;
    return offset == 0.0 || (place > -0.5001 && place < reach + 0.0001);
}

// `count` texels around a position, with the weights of the taps, which are those along x or along y.
Window window_of(Axis axis, int count, bool along_x)
{
    int before = count / 2 - 1;
    Window window;
    window.first = axis.texel - before;
    [[unroll]] for (int i = 0; i < count; ++i)
        window.weights[i] = vec3(0.0);
    [[unroll]] for (int i = 0; i < TAP_COUNT; ++i) {
        vec4 tap = along_x ? FILTER_X(i) : FILTER_Y(i);
        if (UPSAMPLE == UPSAMPLE_INSET_CUBIC)
            add_inset_cubic(window, count, before, axis, tap);
        else if (UPSAMPLE != UPSAMPLE_INSIDE || is_inside(axis, tap.x))
            add_sample(window, count, before, axis.part + tap.x, tap.yzw);
    }
    if (UPSAMPLE == UPSAMPLE_CUBIC) {
        vec4 weights = cubic_weights(axis.part);
        [[unroll]] for (int i = 0; i < 4; ++i)
            window.weights[i] = vec3(weights[i]);
    }
    return window;
}

// The window of a pixel of the target along one axis of an image of this size.
Window window_in(ivec2 size, ivec2 pixel, bool along_x)
{
    ivec2 target_size = ivec2(params.target_width, params.target_height);
    Place place = position_of(size, pixel, target_size);
    vec2 ratio = vec2(size) / vec2(target_size);
    Axis axis = axis_of(place, size, ratio, along_x ? 0 : 1);
    return window_of(settled(axis), WINDOW, along_x);
}
