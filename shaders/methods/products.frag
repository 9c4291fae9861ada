// Adds up products of spectra of images and kernels, each at its own frequency. A texel of complete lines is one channel's,
// and a grey kernel in stages is one number for both channels; the product with a kernel with colours in stages needs the
// frequency of the opposite sign (STAGE_PRODUCT).
#include "lib/complex.glsl"
#include "lib/frequencies.glsl"

UNIFORM_BLOCK(PRODUCTS_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, sum);
SAMPLED_IMAGE(SLOT_FACTORS + 0, glow_0);
SAMPLED_IMAGE(SLOT_FACTORS + 1, kernel_0);
SAMPLED_IMAGE(SLOT_FACTORS + 2, glow_1);
SAMPLED_IMAGE(SLOT_FACTORS + 3, kernel_1);
SAMPLED_IMAGE(SLOT_FACTORS + 4, glow_2);
SAMPLED_IMAGE(SLOT_FACTORS + 5, kernel_2);

#include "lib/fullscreen.glsl"

vec4 product_of(vec4 glow, vec4 kernel)
{
    vec4 by = vec2(1.0, params.kernel_sign).xyxy * kernel;
    return vec4(product(glow.xy, by.xy), product(glow.zw, by.zw));
}

vec4 product_of(vec4 glow, vec4 glow_mirror, vec4 kernel, vec4 kernel_mirror)
{
    // The conjugate spectrum of a real channel is that at the opposite frequency.
    return params.kernel_sign < 0.0 ? channels(glow, glow_mirror, kernel_mirror, kernel)
                                    : channels(glow, glow_mirror, kernel, kernel_mirror);
}

ivec2 mirror_of(ivec2 at)
{
    ivec4 rows = ivec4(params.row_a, params.row_b, params.row_c, params.row_d);
    ivec4 columns = ivec4(params.column_a, params.column_b, params.column_c, params.column_d);
    return ivec2(mirrored(at.x, rows, params.row_length), mirrored(at.y, columns, params.column_length));
}

#define GLOW(number, at)   texelFetch(glow_##number, at, 0)
#define KERNEL(number, at) texelFetch(kernel_##number, at, 0)
#define PRODUCT(number) \
    (STAGE == STAGE_PRODUCT \
         ? product_of(GLOW(number, at), GLOW(number, mirror), KERNEL(number, at), KERNEL(number, mirror)) \
         : product_of(GLOW(number, at), KERNEL(number, of_kernel)))

vec4 sum_of_products(ivec2 at)
{
    ivec2 mirror = STAGE == STAGE_PRODUCT ? mirror_of(at) : at;
    // Channels are beside each other.
    ivec2 of_kernel = at;
    if (params.frequencies > 0)
        of_kernel.x -= params.frequencies * quotient(at.x, params.frequencies);
    vec4 total = ADDS_IMAGE != 0 ? texelFetch(sum, at, 0) : vec4(0.0);
    total += PRODUCT(0);
    if (PRODUCTS > 1)
        total += PRODUCT(1);
    if (PRODUCTS > 2)
        total += PRODUCT(2);
    return total;
}

vec4 shade()
{
    return sum_of_products(PIXEL);
}
