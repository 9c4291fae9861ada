#version 450
#extension GL_GOOGLE_include_directive : require
// A halo: what lies a radius further towards the centre, in a ring of that radius (google/filament,
// flare.mat @ 523a261b1052).
#include "lib/block.glsl"
#include "lib/sampling.glsl"

UNIFORM_BLOCK(FLARE_BLOCK);
#include "lib/storage.glsl"
#include "lib/glare.glsl"
#include "lib/flare.glsl"

#define TARGET_BINDING 2
#include "lib/fullscreen.glsl"

vec4 shade()
{
    vec2 place = FROM_CENTRE;
    float height = float(textureSize(source, 0).y), distance = length(place) / height;
    float ring = 1.0 - smoothstep(0.0, 1.0, abs(distance - params.radius) / params.width);
    vec2 inward = distance > 0.0 ? params.radius / distance * place : vec2(0.0);
    return stored(ring * seen_from_centre(place - inward));
}
