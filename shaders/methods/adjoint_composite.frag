// The cotangents of the composite: of the scene, of the bloom, of the mask, or of intensity, exposure
// and reference white, whose sums are their derivatives.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(COMPOSITE_BLOCK);
#include "lib/composite.glsl"

SAMPLED_IMAGE(SLOT_SCENE, scene);
SAMPLED_IMAGE(SLOT_BLOOM, bloom);
SAMPLED_IMAGE(SLOT_MASK, mask);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#ifdef SUMS
#include "lib/values.glsl"
#else
#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"
#endif
#include "lib/adjoint_composite.glsl"

vec4 cotangent_by(int by)
{
    vec4 light = COMPOSITE == COMPOSITE_OFF ? vec4(0.0) : texelFetch(bloom, PIXEL, 0);
    float share = MASKED != 0 ? texelFetch(mask, PIXEL, 0).r : 1.0;
    return back_composite(texelFetch(scene, PIXEL, 0), light, share, texelFetch(cotangents, PIXEL, 0), by);
}

#ifdef SUMS

vec4 values()
{
    return cotangent_by(BY_VALUES);
}

#else

vec4 shade()
{
    return gathered(cotangent_by(BY));
}

#endif
