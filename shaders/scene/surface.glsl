// The colour and the emission of a mesh at a fragment. With TEXTURED, they are multiplied by
// textures, which hold linear values. The glow (GLOW) has no emission.

#define VARYING in
#include "scene/varyings.glsl"

#ifdef TEXTURED
layout(set = 0, binding = 1) uniform sampler2D base_texture;
layout(set = 0, binding = 2) uniform sampler2D emission_texture;

vec3 surface_colour()
{
    return vertex_colour * texture(base_texture, surface_texcoords.xy).rgb;
}

vec3 emission_texel()
{
    return texture(emission_texture, surface_texcoords.zw).rgb;
}
#else
vec3 surface_colour()
{
    return vertex_colour;
}

vec3 emission_texel()
{
    return vec3(1.0);
}
#endif

#ifndef GLOW
vec3 surface_emission()
{
    return vec3(emission_red, emission_green, emission_blue) * emission_texel();
}
#endif
