// A position along one axis of an image that is enlarged: a texel, and the offset from its centre, 0 to
// 1 texels; the filter (UPSAMPLE_*) and the distance of its taps; the size of the image along this axis,
// and its ratio to the target's.
struct Axis {
    int texel;
    float part;
    int kind;
    float tap_step;
    int size;
    float ratio;
};

// The positions of a pixel in an image, along rows (x) and along columns (y).
Axis axis_x(Place place, int kind, float tap_step, ivec2 size, vec2 ratio)
{
    return Axis(place.texel.x, place.part.x, kind, tap_step, size.x, ratio.x);
}

Axis axis_y(Place place, int kind, float tap_step, ivec2 size, vec2 ratio)
{
    return Axis(place.texel.y, place.part.y, kind, tap_step, size.y, ratio.y);
}

// The weights of a cubic B-spline whose control points are the texels.
vec4 cubic_weights(float part)
{
    float rest = 1.0 - part;
    return vec4(rest * rest * rest, 4.0 - 3.0 * part * part * (2.0 - part),
                4.0 - 3.0 * rest * rest * (2.0 - rest), part * part * part) / 6.0;
}

// The weights of four texels for a tent of three taps at a distance of one texel.
vec4 unit_tent_weights(float part)
{
    return 0.25 * vec4(1.0 - part, 2.0 - part, 1.0 + part, part);
}

// HDRP's border: positions are limited to the middle of the last two texels.
Axis inset(Axis axis)
{
    bool beyond = float(axis.texel - axis.size + 2) + axis.part > 0.5;
    return Axis(beyond ? axis.size - 2 : axis.texel, beyond ? 0.5 : axis.part, axis.kind,
                axis.tap_step, axis.size, axis.ratio);
}

// Two adjacent texels of an axis, and their weights. Every filter is a sum of such pairs.
struct Pair {
    int texel;
    vec2 weights;
};

int pair_count(int kind)
{
    return kind == UPSAMPLE_LINEAR || kind == UPSAMPLE_INSET_LINEAR ? 1
         : kind == UPSAMPLE_TENT                                    ? 3
                                                                    : 2;
}

// A linear interpolation at an offset from the position.
Pair linear_pair(Axis axis, float offset, float weight)
{
    float moved = axis.part + offset, integer = floor(moved), part = moved - integer;
    return Pair(axis.texel + int(integer), weight * vec2(1.0 - part, part));
}

// The cubic filter as two linear taps, neither of them further from the texel than 1 - 1 / size of the
// target (Sigg and Hadwiger, "Fast Third-Order Texture Filtering", GPU Gems 2, chapter 20).
Pair inset_cubic_pair(Axis axis, int i)
{
    float furthest = float(axis.size - 1 - axis.texel) + 0.5 - axis.ratio;
    vec4 cubic = cubic_weights(axis.part);
    vec2 weights = i == 0 ? cubic.xy : cubic.zw;
    float weight = weights.x + weights.y;
    axis.part = 0.0;
    return linear_pair(axis, min(weights.y / weight + float(2 * i - 1), furthest), weight);
}

// Pair number i of a filter.
Pair axis_pair(Axis axis, int i)
{
    if (axis.kind == UPSAMPLE_INSET_LINEAR)
        return linear_pair(inset(axis), 0.0, 1.0);
    if (axis.kind == UPSAMPLE_INSET_CUBIC)
        return inset_cubic_pair(inset(axis), i);
    // Two taps at the same distance before and after the position.
    if (axis.kind == UPSAMPLE_PAIR)
        return linear_pair(axis, i == 0 ? -axis.tap_step : axis.tap_step, 1.0);
    // Three taps with the weights (1 2 1) / 4.
    if (axis.kind == UPSAMPLE_TENT)
        return linear_pair(axis, float(i - 1) * axis.tap_step, i == 1 ? 0.5 : 0.25);
    if (axis.kind == UPSAMPLE_CUBIC || axis.kind == UPSAMPLE_UNIT_TENT) {
        vec4 weights =
            axis.kind == UPSAMPLE_CUBIC ? cubic_weights(axis.part) : unit_tent_weights(axis.part);
        return Pair(axis.texel - 1 + 2 * i, i == 0 ? weights.xy : weights.zw);
    }
    return linear_pair(axis, 0.0, 1.0);
}
