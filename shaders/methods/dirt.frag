// Dirt on the lens: the light of bloom and glare, multiplied by a picture.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(DIRT_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, light);
SAMPLED_IMAGE(SLOT_DIRT, dirt);

#include "lib/fullscreen.glsl"

vec4 shade()
{
    vec4 left = params.base + params.share * sample_at(dirt, PLACE_IN(dirt), vec2(0.0), SAMPLING);
    return stored(left * texelFetch(light, PIXEL, 0));
}
