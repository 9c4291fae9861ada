// Adds up products of spectra of images and kernels (products.frag). With RADIX_1 it does the last stage of the images'
// transforms along columns, too: one load and one store less for each.
#include "lib/fourier.glsl"
#include "lib/frequencies.glsl"

UNIFORM_BLOCK(PRODUCTS_BLOCK);
#include "variants/pixels.glsl"

READ_IMAGE(SLOT_SOURCE, sum);
READ_IMAGE(SLOT_FACTORS + 0, glow_0);
READ_IMAGE(SLOT_FACTORS + 1, kernel_0);
READ_IMAGE(SLOT_FACTORS + 2, glow_1);
READ_IMAGE(SLOT_FACTORS + 3, kernel_1);
READ_IMAGE(SLOT_FACTORS + 4, glow_2);
READ_IMAGE(SLOT_FACTORS + 5, kernel_2);

layout(local_size_x = ROW_INVOCATIONS) in;
#include "variants/store_float.glsl"

#define LOAD_SPECTRUM(name, slot, at) load_floats(name, read_shapes[slot], (at).x, (at).y)
#include "lib/products.glsl"

// Adds products with what a butterfly makes of elements from `first` on.
#define ADD_TRANSFORMED(number) \
    [[unroll]] for (int i = 0; i < RADIX_1; ++i) \
        by[i] = KERNEL(number, first + ivec2(0, i)); \
    [[unroll]] for (int i = 0; i < RADIX_1; ++i) \
        held[i] = GLOW(number, first + ivec2(0, i)); \
    transform_held(RADIX_1, false); \
    [[unroll]] for (int i = 0; i < RADIX_1; ++i) \
        total[i] += product_of(held[place_of(i, RADIX_1)], by[i])

void add_up(ivec2 first)
{
    vec4 total[FFT_MAX_RADIX], by[FFT_MAX_RADIX];
    [[unroll]] for (int i = 0; i < RADIX_1; ++i)
        total[i] = ADDS_IMAGE != 0 ? LOAD_SPECTRUM(sum, SLOT_SOURCE, first + ivec2(0, i)) : vec4(0.0);
    ADD_TRANSFORMED(0);
    if (PRODUCTS > 1) {
        ADD_TRANSFORMED(1);
    }
    if (PRODUCTS > 2) {
        ADD_TRANSFORMED(2);
    }
    [[unroll]] for (int i = 0; i < RADIX_1; ++i)
        held[i] = total[i];
}

void main()
{
    copy_shapes();
    ivec2 first = first_pixel(ivec2(1, RADIX_1 > 0 ? RADIX_1 : TEXEL_ROWS));
    int end = min(first.y + TEXEL_ROWS, target_shape.y), x = min(first.x, target_shape.x - 1);

    if (RADIX_1 > 0) {
        add_up(ivec2(x, first.y));
        [[unroll]] for (int i = 0; i < RADIX_1; ++i)
            store_float(first.x, first.y + i, held[i]);
        return;
    }
    for (int y = first.y; y < end; ++y)
        store_float(first.x, y, sum_of_products(ivec2(x, y)));
}
