// Ghosts: the source scaled about its centre, added up with tints (Chapman, "Pseudo Lens Flare", 2013),
// and added to others.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FLARE_BLOCK);
#include "lib/fetch_inside.glsl"
#include "lib/flare.glsl"

SAMPLED_IMAGE(SLOT_BEFORE, before);

#include "lib/fullscreen.glsl"

vec4 shade()
{
    vec2 place = FROM_CENTRE;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < params.count; ++i)
        sum += ghost_factor(params.ghosts[i], place) * seen_from_centre(params.ghosts[i].w * place);
    sum *= corner_factor(place);
    return stored(ADDS_IMAGE != 0 ? texelFetch(before, PIXEL, 0) + sum : sum);
}
