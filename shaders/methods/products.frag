// Adds up products of spectra of images and kernels.
#include "lib/fourier.glsl"
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

#define LOAD_SPECTRUM(name, slot, at) texelFetch(name, at, 0)
#include "lib/products.glsl"

vec4 shade()
{
    return sum_of_products(PIXEL);
}
