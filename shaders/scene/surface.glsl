// The colour and the emission of a mesh at a fragment. With TEXTURED, they are multiplied by
// textures, which hold linear values.

layout(location = 2) in vec3 vertex_colour;
layout(location = 3) in vec3 vertex_emission;

#ifdef TEXTURED
layout(location = 4) in vec4 surface_texcoords;

layout(set = 0, binding = 1) uniform sampler2D base_texture;
layout(set = 0, binding = 2) uniform sampler2D emission_texture;

vec3 surface_colour()
{
    return vertex_colour * texture(base_texture, surface_texcoords.xy).rgb;
}

vec3 surface_emission()
{
    return vertex_emission * texture(emission_texture, surface_texcoords.zw).rgb;
}
#else
vec3 surface_colour()
{
    return vertex_colour;
}

vec3 surface_emission()
{
    return vertex_emission;
}
#endif
