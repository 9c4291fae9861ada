// The sum of products of the spectra of images and kernels, each at its own frequency. Complete lines have
// separated channels, and a grey kernel is one number for both channels; the product with a kernel with
// colours in stages needs the frequency of the opposite sign (STAGE_PRODUCT). Define LOAD_SPECTRUM(name, slot, at)
// first.

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

#define GLOW(number, at)   LOAD_SPECTRUM(glow_##number, SLOT_FACTORS + 2 * number, at)
#define KERNEL(number, at) LOAD_SPECTRUM(kernel_##number, SLOT_FACTORS + 2 * number + 1, at)
#define PRODUCT(number) \
    (STAGE == STAGE_PRODUCT \
         ? product_of(GLOW(number, at), GLOW(number, mirror), KERNEL(number, at), KERNEL(number, mirror)) \
         : product_of(GLOW(number, at), KERNEL(number, at)))

vec4 sum_of_products(ivec2 at)
{
    ivec2 mirror = STAGE == STAGE_PRODUCT ? mirror_of(at) : at;
    vec4 total = ADDS_IMAGE != 0 ? LOAD_SPECTRUM(sum, SLOT_SOURCE, at) : vec4(0.0);
    total += PRODUCT(0);
    if (PRODUCTS > 1)
        total += PRODUCT(1);
    if (PRODUCTS > 2)
        total += PRODUCT(2);
    return total;
}
