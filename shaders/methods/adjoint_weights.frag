// Cotangents of up to four weights of a field, added up along one axis between the places of its grid. Each interval
// has `parts`, whose pixels are at distances of their number; the sums of the place before are in the first picture,
// those of the next place below it (fullscreen.glsl). The cotangents at a pixel are an image times what the kernel of
// each weight makes of the other one, added up over the channels; or, without products, sums along the other axis.
UNIFORM_BLOCK(NODE_SUMS_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_FACTORS + 0, factor_0);
SAMPLED_IMAGE(SLOT_FACTORS + 1, factor_1);
SAMPLED_IMAGE(SLOT_FACTORS + 2, factor_2);
SAMPLED_IMAGE(SLOT_FACTORS + 3, factor_3);
SAMPLED_IMAGE(SLOT_NODES, places);

#define STACKED 2
#define STACKED_HEIGHT params.lines
#include "lib/fullscreen.glsl"

vec4 sums[STACKED];

vec4 value_at(ivec2 at)
{
    vec4 texel = texelFetch(source, at, 0), result = vec4(0.0);
    vec4 by = vec4(texel.rgb, ALPHA == ALPHA_BLUR ? texel.a : 0.0);
    if (PRODUCTS == 0)
        return texel;
    result.r = inner_product(by, texelFetch(factor_0, at, 0));
    if (PRODUCTS > 1)
        result.g = inner_product(by, texelFetch(factor_1, at, 0));
    if (PRODUCTS > 2)
        result.b = inner_product(by, texelFetch(factor_2, at, 0));
    if (PRODUCTS > 3)
        result.a = inner_product(by, texelFetch(factor_3, at, 0));
    return result;
}

void start()
{
    const bool vertical = DIRECTION == DIRECTION_VERTICAL;
    int line = vertical ? 1 : 0, own = vertical ? PIXEL.y : PIXEL.x, cell = own / params.parts;
    int first = int(texelFetch(places, ivec2(cell, line), 0).b);
    int end = int(texelFetch(places, ivec2(cell + 1, line), 0).b);
    sums[0] = sums[1] = vec4(0.0);
    for (int i = first + own % params.parts; i < end; i += params.parts) {
        vec4 value = value_at(vertical ? ivec2(PIXEL.x, i) : ivec2(i, PIXEL.y));
        float share = texelFetch(places, ivec2(i, line), 0).g;
        sums[0] += (1.0 - share) * value;
        sums[1] += share * value;
    }
}

vec4 shade()
{
    return sums[picture];
}
