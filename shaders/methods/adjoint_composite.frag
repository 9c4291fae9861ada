// The cotangents of the composite: of the scene, of the bloom, of the mask, or of intensity, exposure
// and reference white, whose sums are their derivatives.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(COMPOSITE_BLOCK);
#include "lib/composite.glsl"

layout(set = 0, binding = 1) uniform sampler2D scene;
layout(set = 0, binding = 2) uniform sampler2D bloom;
layout(set = 0, binding = 3) uniform sampler2D mask;
layout(set = 0, binding = 4) uniform sampler2D cotangents;

#define ADDED_BINDING 5
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"
#include "lib/adjoint_composite.glsl"

vec4 shade()
{
    vec4 light = COMPOSITE == COMPOSITE_OFF ? vec4(0.0) : texelFetch(bloom, PIXEL, 0);
    float share = MASKED != 0 ? texelFetch(mask, PIXEL, 0).r : 1.0;
    return gathered(back_composite(texelFetch(scene, PIXEL, 0), light, share,
                                   texelFetch(cotangents, PIXEL, 0), BY));
}
