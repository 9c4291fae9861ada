#version 450
#extension GL_GOOGLE_include_directive : require
// Ghosts: the source scaled about its centre, added up with tints (Chapman, "Pseudo Lens Flare", 2013),
// and added to others.
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FLARE_BLOCK);
#include "lib/storage.glsl"
#include "lib/glare.glsl"
#include "lib/flare.glsl"

layout(set = 0, binding = 2) uniform sampler2D before;

#define TARGET_BINDING 3
#include "lib/fullscreen.glsl"

// Falls towards the border of what a ghost shows.
float weight(vec2 share)
{
    float left = max(1.0 - length(share) / params.radius, 0.0);
    return params.falloff > 0.0 ? pow(left, params.falloff) : 1.0;
}

vec4 shade()
{
    vec2 size = vec2(textureSize(source, 0)), place = FROM_CENTRE;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < params.count; ++i) {
        vec3 tint = params.ghosts[i].rgb;
        vec2 offset = params.ghosts[i].w * place;
        vec4 tints = vec4(tint, (tint.r + tint.g + tint.b) / 3.0);
        sum += weight(offset / size) * tints * seen_from_centre(offset);
    }
    vec2 corner = 2.0 * place / size;
    float squared = dot(corner, corner);
    sum *= mix(1.0, min(squared * squared, 1.0), params.vignette);
    return stored(ADD_OWN != 0 ? texelFetch(before, PIXEL, 0) + sum : sum);
}
