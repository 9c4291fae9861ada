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
    float height = float(textureSize(source, 0).y), distance = length(place);
    float share = 1.0 - smoothstep(0.0, 1.0, abs(distance / height - params.radius) / params.width);
    // The direction must be exact, since red and blue are moved along it also where the sample is near the centre.
    vec2 offset = distance > 0.0 ? (distance - params.radius * height) / distance * place : vec2(0.0);
    return stored(share * seen_from_centre(offset));
}
