// The cotangents of what a stage of glare reads, from those of what is above the stage's threshold.

UNIFORM_BLOCK(STREAKS_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

vec4 shade()
{
    vec4 cotangent = texelFetch(cotangents, PIXEL, 0);
    if (ALPHA != ALPHA_BLUR)
        cotangent.a = 0.0;
    return gathered(back_part_above(texelFetch(source, PIXEL, 0), cotangent, params.threshold));
}
