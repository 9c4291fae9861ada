// Defines the filter of an image along one axis, for passes that filter along one of the two. Define
// before each inclusion:
//
//   AXIS_FILTER        the name of the filter
//   AXIS_IMAGE         the parameter by which it takes the image
//   AXIS_TEXEL(at)     the texel at a position along the axis, of the line `line`
//
// Without a loop over the pairs, which lavapipe runs more slowly.

#define AXIS_SUM(pair) \
    (pair.weights.x * AXIS_TEXEL(pair.texel) + pair.weights.y * AXIS_TEXEL(pair.texel + 1))

vec4 AXIS_FILTER(AXIS_IMAGE, Axis axis, int line)
{
    int count = pair_count(axis.kind);
    Pair first = axis_pair(axis, 0), second = axis_pair(axis, 1), third = axis_pair(axis, 2);
    vec4 sum = AXIS_SUM(first);
    if (count > 1)
        sum += AXIS_SUM(second);
    if (count > 2)
        sum += AXIS_SUM(third);
    return sum;
}

#undef AXIS_FILTER
#undef AXIS_IMAGE
#undef AXIS_TEXEL
#undef AXIS_SUM
