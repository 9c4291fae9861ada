// The cotangents of the samples of tap LEVELS of a streak.

UNIFORM_BLOCK(STREAKS_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D cotangents;

#define ADDED_BINDING 2
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"

vec4 shade()
{
    return gathered(params.weights[LEVELS] * texelFetch(cotangents, PIXEL, 0));
}
