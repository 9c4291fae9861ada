// The cotangents of the samples of tap STREAK_TAP of a streak.

UNIFORM_BLOCK(STREAKS_BLOCK);

SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

vec4 shade()
{
    return gathered(params.weights[STREAK_TAP] * texelFetch(cotangents, PIXEL, 0));
}
