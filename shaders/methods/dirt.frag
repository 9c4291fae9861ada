// Dirt on the lens: the light of bloom and glare, multiplied by a picture.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(DIRT_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D light;
layout(set = 0, binding = 2) uniform sampler2D dirt;

#include "lib/fullscreen.glsl"

vec4 shade()
{
    vec4 left = params.base + params.share * sample_at(dirt, PLACE_IN(dirt), vec2(0.0), SAMPLING);
    return stored(left * texelFetch(light, PIXEL, 0));
}
