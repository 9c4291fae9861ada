// Cotangents of up to four weights of a field at each pixel: an image times what the kernel of each weight makes of the
// other one, added up over the channels.

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_FACTORS + 0, factor_0);
SAMPLED_IMAGE(SLOT_FACTORS + 1, factor_1);
SAMPLED_IMAGE(SLOT_FACTORS + 2, factor_2);
SAMPLED_IMAGE(SLOT_FACTORS + 3, factor_3);

#include "lib/fullscreen.glsl"

vec4 shade()
{
    vec4 texel = texelFetch(source, PIXEL, 0), result = vec4(0.0);
    vec4 by = vec4(texel.rgb, ALPHA == ALPHA_BLUR ? texel.a : 0.0);
    result.r = inner_product(by, texelFetch(factor_0, PIXEL, 0));
    if (PRODUCTS > 1)
        result.g = inner_product(by, texelFetch(factor_1, PIXEL, 0));
    if (PRODUCTS > 2)
        result.b = inner_product(by, texelFetch(factor_2, PIXEL, 0));
    if (PRODUCTS > 3)
        result.a = inner_product(by, texelFetch(factor_3, PIXEL, 0));
    return result;
}
