// The cotangents of what a halo or a ghost, the only one here, samples.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FLARE_BLOCK);
#include "lib/fetch_inside.glsl"
#include "lib/flare.glsl"

SAMPLED_IMAGE(SLOT_COTANGENTS, cotangents);

#include "lib/fullscreen.glsl"
#include "lib/adjoint.glsl"
#include "lib/target_cotangents.glsl"

vec4 shade()
{
    vec2 place = FROM_CENTRE;
    vec4 value = colours_from_centre(flare_offset(place)), cotangent = cotangent_of_target();
    cotangent *= params.count == 0 ? vec4(halo_factor(place))
                                   : ghost_factor(params.ghosts[0], place) * corner_factor(place);
    vec4 above = PART_ABOVE != 0 ? part_above(value, params.threshold) : value;
    cotangent.rgb *= larger(vec4(params.maximum), above).rgb;
    if (PART_ABOVE != 0)
        cotangent = back_part_above(value, cotangent, params.threshold);
    return gathered(cotangent);
}
