// The cotangents of the light at the end of Blender's glare, at the pixels of the bloom. With THROUGH_COMPOSITE from those
// of a composite without a curve; then `factors` have its intensity and exposure.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(BLENDER_END_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);
SAMPLED_IMAGE(SLOT_ENDED, scene);
SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#include "lib/fullscreen.glsl"
#include "lib/blender_end.glsl"
#include "lib/adjoint.glsl"
#include "lib/target_cotangents.glsl"

vec4 shade()
{
    vec4 cotangent = params.factors[0] * cotangent_of_target();
    if (THROUGH_COMPOSITE != 0)
        cotangent = vec4(where_finite(cotangent, texelFetch(scene, PIXEL, 0)).rgb, 0.0);
    return gathered(vec4(back_saturated(settled(enlarged().rgb), cotangent.rgb), cotangent.a));
}
