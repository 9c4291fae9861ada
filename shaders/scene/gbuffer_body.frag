// The mesh that is lit later, in view space, with the emission of its material.
#include "scene/gbuffer.glsl"

#include "scene/surface.glsl"

void main()
{
    float size = length(view_normal);
    albedo = vec4(storable(surface_colour()), 1.0);
    normal = vec4(storable(size > 0.0 ? view_normal / size : vec3(0.0)), 1.0);
    position = vec4(storable(view_position), 1.0);
    brightness = vec4(storable(clamp_to_part(surface_emission())), 1.0);
}
