// A halo: what lies a radius further towards the centre, in a ring of that radius (google/filament,
// flare.mat @ 523a261b1052).
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FLARE_BLOCK);
#include "lib/fetch_inside.glsl"
#include "lib/flare.glsl"

#include "lib/fullscreen.glsl"

vec4 shade()
{
    vec2 place = FROM_CENTRE;
    return stored(halo_factor(place) * seen_from_centre(halo_offset(place)));
}
