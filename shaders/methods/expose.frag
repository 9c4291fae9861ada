// An image times a multiplier of its exposure. Alpha stays.
#include "lib/exposure.glsl"

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_EXPOSURE, exposure);

#include "lib/fullscreen.glsl"

vec4 shade()
{
    vec4 value = texelFetch(source, PIXEL, 0);
    float multiplier = texelFetch(exposure, ivec2(0), 0)[params.channel];
    return vec4(value.rgb * multiplier, value.a);
}
