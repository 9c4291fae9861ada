// Defines the filter of an image along one axis. Each filter is a product of two such filters: all
// variants of a pass first filter along rows, then the results along columns. Define before each
// inclusion:
//
//   AXIS_FILTER        the name of the filter, and AXIS_LINEAR that of a linear interpolation
//   AXIS_IMAGE         the parameter by which both take the image, AXIS_ARGUMENT how they pass it on
//   AXIS_TEXEL(at)     the texel at a position along the axis, of the line `line`

vec4 AXIS_LINEAR(AXIS_IMAGE, Axis axis, float offset, int line)
{
    float moved = axis.part + offset, integer = floor(moved), part = moved - integer;
    int at = axis.texel + int(integer);
    return blended(AXIS_TEXEL(at), AXIS_TEXEL(at + 1), part);
}

// The cubic filter as two linear taps, neither of them further from the texel than 1 - 1 / size of the
// target (Sigg and Hadwiger, "Fast Third-Order Texture Filtering", GPU Gems 2, chapter 20).
vec4 AXIS_INSET_CUBIC(AXIS_IMAGE, Axis axis, int line)
{
    float furthest = float(axis.size - 1 - axis.texel) + 0.5 - axis.ratio;
    vec4 weights = cubic_weights(axis.part);
    float left = weights.x + weights.y, right = weights.z + weights.w;
    float near = min(weights.y / left - 1.0, furthest), far = min(weights.w / right + 1.0, furthest);
    axis.part = 0.0;
    return left * AXIS_LINEAR(AXIS_ARGUMENT, axis, near, line)
         + right * AXIS_LINEAR(AXIS_ARGUMENT, axis, far, line);
}

vec4 AXIS_FILTER(AXIS_IMAGE, Axis axis, int line)
{
    if (axis.kind == UPSAMPLE_LINEAR)
        return AXIS_LINEAR(AXIS_ARGUMENT, axis, 0.0, line);
    if (axis.kind == UPSAMPLE_INSET_LINEAR)
        return AXIS_LINEAR(AXIS_ARGUMENT, inset(axis), 0.0, line);
    if (axis.kind == UPSAMPLE_INSET_CUBIC)
        return AXIS_INSET_CUBIC(AXIS_ARGUMENT, inset(axis), line);
    // Two taps at the same distance before and after the position.
    if (axis.kind == UPSAMPLE_PAIR)
        return AXIS_LINEAR(AXIS_ARGUMENT, axis, -axis.tap_step, line)
             + AXIS_LINEAR(AXIS_ARGUMENT, axis, axis.tap_step, line);
    if (axis.kind == UPSAMPLE_CUBIC || axis.kind == UPSAMPLE_UNIT_TENT) {
        vec4 weights =
            axis.kind == UPSAMPLE_CUBIC ? cubic_weights(axis.part) : unit_tent_weights(axis.part);
        return weights.x * AXIS_TEXEL(axis.texel - 1) + weights.y * AXIS_TEXEL(axis.texel)
             + weights.z * AXIS_TEXEL(axis.texel + 1) + weights.w * AXIS_TEXEL(axis.texel + 2);
    }
    // The tent: three taps with the weights (1 2 1) / 4.
    return 0.25 * AXIS_LINEAR(AXIS_ARGUMENT, axis, -axis.tap_step, line)
         + 0.5 * AXIS_LINEAR(AXIS_ARGUMENT, axis, 0.0, line)
         + 0.25 * AXIS_LINEAR(AXIS_ARGUMENT, axis, axis.tap_step, line);
}

#undef AXIS_FILTER
#undef AXIS_LINEAR
#undef AXIS_INSET_CUBIC
#undef AXIS_IMAGE
#undef AXIS_ARGUMENT
#undef AXIS_TEXEL
