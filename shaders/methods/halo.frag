// A halo: what lies a radius further towards the centre, in a ring of that radius (google/filament,
// flare.mat @ 523a261b1052).
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FLARE_BLOCK);
#include "lib/glare.glsl"
#include "lib/flare.glsl"

#include "lib/fullscreen.glsl"

vec4 shade()
{
    return stored(halo_factor(FROM_CENTRE) * seen_from_centre(halo_offset(FROM_CENTRE)));
}
