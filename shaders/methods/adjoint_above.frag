// The cotangents of what a stage of glare reads, from those of what is above the stage's threshold.

UNIFORM_BLOCK(STREAKS_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"
#include "lib/target_cotangents.glsl"

vec4 shade()
{
    return gathered(back_part_above(texelFetch(source, PIXEL, 0), cotangent_of_target(), params.threshold));
}
