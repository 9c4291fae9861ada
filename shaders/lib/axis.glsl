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
