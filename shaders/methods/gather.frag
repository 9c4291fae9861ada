// Adds up levels of several sizes: each is enlarged and multiplied by its weight.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FILTER_BLOCK);

SAMPLED_IMAGE(SLOT_LEVELS + 0, level_0);
SAMPLED_IMAGE(SLOT_LEVELS + 1, level_1);
SAMPLED_IMAGE(SLOT_LEVELS + 2, level_2);
SAMPLED_IMAGE(SLOT_LEVELS + 3, level_3);
SAMPLED_IMAGE(SLOT_LEVELS + 4, level_4);
SAMPLED_IMAGE(SLOT_LEVELS + 5, level_5);
SAMPLED_IMAGE(SLOT_LEVELS + 6, level_6);

#include "lib/fullscreen.glsl"
#include "lib/gathered.glsl"
#include "lib/filter_image.glsl"

vec4 share(sampler2D image, int level)
{
    if (level >= LEVELS)
        return vec4(0.0);
    float weight = params.shares[level >> 2][level & 3];
    return weight * filtered(image);
}

vec4 shade()
{
    vec4 sum = share(level_0, 0) + share(level_1, 1) + share(level_2, 2) + share(level_3, 3)
             + share(level_4, 4) + share(level_5, 5) + share(level_6, 6);
    return stored(sum);
}
