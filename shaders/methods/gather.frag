// Adds up levels of several sizes: each is enlarged and multiplied by its weight.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(GATHER_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D level_0;
layout(set = 0, binding = 2) uniform sampler2D level_1;
layout(set = 0, binding = 3) uniform sampler2D level_2;
layout(set = 0, binding = 4) uniform sampler2D level_3;
layout(set = 0, binding = 5) uniform sampler2D level_4;
layout(set = 0, binding = 6) uniform sampler2D level_5;
layout(set = 0, binding = 7) uniform sampler2D level_6;

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
