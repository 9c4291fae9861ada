// The colour and the emission of a mesh at a fragment. With TEXTURED, they are multiplied by
// textures, which hold linear values.

#define VARYING in
#include "scene/varyings.glsl"

vec3 vertex_emission()
{
    return vec3(emission_red, emission_green, emission_blue);
}

#ifdef TEXTURED
layout(location = 3) in vec4 surface_texcoords;

layout(set = 0, binding = 1) uniform sampler2D base_texture;
layout(set = 0, binding = 2) uniform sampler2D emission_texture;

vec3 surface_colour()
{
    return vertex_colour * texture(base_texture, surface_texcoords.xy).rgb;
}

vec3 surface_emission()
{
    return vertex_emission() * texture(emission_texture, surface_texcoords.zw).rgb;
}
#else
vec3 surface_colour()
{
    return vertex_colour;
}

vec3 surface_emission()
{
    return vertex_emission();
}
#endif
