// Filters an image for this pixel of a larger one: along rows, then along columns.
// Include fullscreen.glsl before this file.
#include "lib/axis.glsl"

// Loops, since drivers inline each call: with a branch for each kind of filter, one upsampling had 484
// reads, and some drivers took a second to compile the seven of gather.frag.
vec4 filter_row(sampler2D image, Axis axis, int line)
{
    vec4 sum = vec4(0.0);
    [[unroll]] for (int i = 0; i < pair_count(axis.kind); ++i) {
        Pair pair = axis_pair(axis, i);
        sum += pair.weights.x * fetch_clamped(image, ivec2(pair.texel, line))
             + pair.weights.y * fetch_clamped(image, ivec2(pair.texel + 1, line));
    }
    return sum;
}

// The filters along rows and along columns are of UPSAMPLE_*; the steps are the distances of their
// taps in texels of the image.
vec4 upsample(sampler2D image, ivec2 kinds, vec2 tap_step)
{
    Place place = PLACE_IN(image);
    ivec2 size = textureSize(image, 0);
    vec2 ratio = vec2(COMPLETE_SIZE(image)) / vec2(params.target_width, params.target_height);
    Axis row = axis_x(place, kinds.x, tap_step.x, size, ratio);
    Axis column = axis_y(place, kinds.y, tap_step.y, size, ratio);
    vec4 sum = vec4(0.0);
    [[unroll]] for (int i = 0; i < pair_count(column.kind); ++i) {
        Pair pair = axis_pair(column, i);
        sum += pair.weights.x * filter_row(image, row, pair.texel)
             + pair.weights.y * filter_row(image, row, pair.texel + 1);
    }
    return sum;
}
