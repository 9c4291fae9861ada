// Adds up products of spectra of images and kernels (products.frag).
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

void main()
{
    copy_shapes();
    ivec2 first = first_pixel(ivec2(1, TEXEL_ROWS));
    int end = min(first.y + TEXEL_ROWS, target_shape.y), x = min(first.x, target_shape.x - 1);

    for (int y = first.y; y < end; ++y)
        store_float(first.x, y, sum_of_products(ivec2(x, y)));
}
