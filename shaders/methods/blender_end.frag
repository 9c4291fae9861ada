// The end of Blender's glare: enlarged, with another saturation, tinted (formulas of the compositor of
// Blender 5.0 and 5.2).
#include "lib/sampling.glsl"

UNIFORM_BLOCK(BLENDER_END_BLOCK);

SAMPLED_IMAGE(SLOT_SOURCE, source);

#include "lib/fullscreen.glsl"
#include "lib/blender_end.glsl"

vec4 shade()
{
    vec4 value = enlarged();
    return stored(vec4(saturated(value.rgb), value.a) * params.factors[0]);
}
