// The cotangents of the light at the end of Blender's glare, at the pixels of the bloom.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(BLENDER_END_BLOCK);

layout(set = 0, binding = 1) uniform sampler2D source;
layout(set = 0, binding = 2) uniform sampler2D cotangents;

#define ADDED_BINDING 3
#include "lib/fullscreen.glsl"
#include "lib/blender_end.glsl"
#include "lib/adjoint.glsl"

vec4 shade()
{
    vec4 cotangent = params.factors[0] * texelFetch(cotangents, PIXEL, 0);
    if (ALPHA != ALPHA_BLUR)
        cotangent.a = 0.0;
    return gathered(vec4(back_saturated(settled(enlarged().rgb), cotangent.rgb), cotangent.a));
}
