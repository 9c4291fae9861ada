// The colour and the emission of a mesh at a fragment. A shader that defines TEXTURED multiplies
// them by textures, which hold linear values.

layout(location = 2) in vec3 vertex_colour;
layout(location = 3) in vec3 vertex_emission;

#ifdef TEXTURED
layout(location = 4) in vec4 places;

layout(set = 0, binding = 1) uniform sampler2D base_texture;
layout(set = 0, binding = 2) uniform sampler2D emission_texture;

vec3 surface_colour()
{
    return vertex_colour * texture(base_texture, places.xy).rgb;
}

vec3 surface_emission()
{
    return vertex_emission * texture(emission_texture, places.zw).rgb;
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
