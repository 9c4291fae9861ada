// Ends a pass that writes the cotangents of an image: adds what other readers of the image have accumulated.

SAMPLED_IMAGE(SLOT_ADDED, added);
SAMPLED_IMAGE(SLOT_DIFFERENTIATED, differentiated);

// What other readers have accumulated. At 0, the slope of max(x, 0) is the mean of both sides.
vec4 added_here()
{
    vec4 value = texelFetch(added, PIXEL, 0);
    return OF_POSITIVE != 0 ? value * vec4(0.5 + 0.5 * sign(texelFetch(differentiated, PIXEL, 0).rgb), 1.0) : value;
}

// The cotangents of this pixel. The image of a source has none at NaN and infinity.
vec4 gathered(vec4 cotangent)
{
    if (ADDS_IMAGE != 0)
        cotangent += added_here();
    return OF_SOURCE != 0 ? where_finite(cotangent, texelFetch(differentiated, PIXEL, 0))
                           : cotangent;
}
