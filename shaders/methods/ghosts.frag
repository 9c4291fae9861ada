// Ghosts: the source scaled about its centre, added up with tints (Chapman, "Pseudo Lens Flare", 2013),
// and added to others.
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FLARE_BLOCK);
#include "lib/fetch_inside.glsl"
#include "lib/flare.glsl"

layout(set = 0, binding = 2) uniform sampler2D before;

#include "lib/fullscreen.glsl"

// What a ghost shows of its sample for a place: its tints, less towards the border.
vec4 ghost_factor(vec4 ghost, vec2 place)
{
    vec2 share = ghost.w * place / vec2(textureSize(source, 0));
    float left = max(1.0 - length(share) / params.radius, 0.0);
    float weight = params.falloff > 0.0 ? pow(left, params.falloff) : 1.0;
    return weight * vec4(ghost.rgb, (ghost.r + ghost.g + ghost.b) / 3.0);
}

vec4 shade()
{
    vec2 place = FROM_CENTRE, corner = 2.0 * place / vec2(textureSize(source, 0));
    float squared = dot(corner, corner);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < params.count; ++i)
        sum += ghost_factor(params.ghosts[i], place) * seen_from_centre(params.ghosts[i].w * place);
    sum *= mix(1.0, min(squared * squared, 1.0), params.vignette);
    return stored(ADD_OWN != 0 ? texelFetch(before, PIXEL, 0) + sum : sum);
}
