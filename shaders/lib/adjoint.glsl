// Ends a pass that writes the cotangents of an image: adds what other readers of the image have accumulated.

SAMPLED_IMAGE(SLOT_ADDED, added);
SAMPLED_IMAGE(SLOT_DIFFERENTIATED, differentiated);

// The cotangents of this pixel. The image of a source has none at NaN and infinity.
vec4 gathered(vec4 cotangent)
{
    if (ADDS_IMAGE != 0)
        cotangent += texelFetch(added, PIXEL, 0);
    return OF_SOURCE != 0 ? where_finite(cotangent, texelFetch(differentiated, PIXEL, 0))
                           : cotangent;
}
