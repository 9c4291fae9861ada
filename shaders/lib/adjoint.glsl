// Ends a pass that writes the cotangents of an image. The including shader defines ADDED_BINDING:
// there is what other readers of the image have accumulated, and after it the image itself.

layout(set = 0, binding = ADDED_BINDING) uniform sampler2D added;
layout(set = 0, binding = ADDED_BINDING + 1) uniform sampler2D differentiated;

// The cotangents of this pixel. The image of a source has none at NaN and infinity.
vec4 gathered(vec4 cotangent)
{
    if (ADD_OWN != 0)
        cotangent += texelFetch(added, PIXEL, 0);
    return FROM_IMAGE != 0 ? where_finite(cotangent, texelFetch(differentiated, PIXEL, 0))
                           : cotangent;
}
